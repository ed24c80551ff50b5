// What is random in a variation of a task, as the list `randomize` of its YAML file says.
#pragma once

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "models/source_location.h"
#include "models/yaml_reader.h"

namespace evalbus {

// Uniform position in a box around `center`, not nearer than min_distance to any other free or placed part.
// Height stays the part's own.
struct SpawnBox {
  std::string object;
  std::array<double, 2> center{};        // x, y, m
  std::array<double, 2> half_extents{};  // x, y, m
  double min_distance = 0;               // m
};

// Grid of floor(2 ex / s) by floor(2 ey / s) points of pitch s around `origin`; as many distinct points as
// there are objects, plus a uniform jitter of +-j per axis.
struct SpawnPlane {
  std::vector<std::string> objects;
  std::array<double, 3> origin{};        // m
  std::array<double, 2> half_extents{};  // m
  double spacing = 0;                    // m
  std::array<double, 3> jitter{};        // m
};

// Uniform rotation in +-bound about world z, on top of the part's base orientation.
struct SpawnYaw {
  std::string object;
  double bound = 0;  // rad
};

// Uniform start position of a joint, rad or m.
struct SpawnJoint {
  std::string joint;
  bool is_angle = false;
  double min = 0, max = 0;
  SourceLocation location;
};

using Randomization = std::variant<SpawnBox, SpawnPlane, SpawnYaw, SpawnJoint>;

// A number of free parts, uniform from min to max, uniform in a box around `center` and turned by any angle
// about the vertical; the others are far away. Height stays the part's own.
struct Distractors {
  std::vector<std::string> objects;
  int min_count = 0, max_count = 0;
  std::array<double, 2> center{};        // x, y, m
  std::array<double, 2> half_extents{};  // x, y, m
};

struct NameInFile {
  std::string text;
  SourceLocation location;
};

struct Span {
  double min = 0, max = 0;
};

// What an episode changes of the model itself (randomized_model.h). `of` are parts or bodies, each with all
// that is attached to it; one draw is for all of them.

// Mass and inertia times a factor.
struct RandomMass {
  std::vector<NameInFile> of;
  Span factor;
};

struct RandomFriction {
  std::vector<NameInFile> of;
  Span factor;
};

// Uniform in each of red, green and blue.
struct RandomColor {
  std::vector<NameInFile> of;
  std::array<double, 3> min{}, max{};
};

// Brightness times a factor.
struct RandomLight {
  NameInFile name;
  Span factor;
};

// Shifted by up to `shift` along each axis of the world and turned by up to `turn` about each of its own.
struct RandomCamera {
  NameInFile name;
  std::array<double, 3> shift{};  // m
  double turn = 0;                // rad
};

using PhysicsChange = std::variant<RandomMass, RandomFriction>;
using AppearanceChange = std::variant<RandomColor, RandomLight, RandomCamera>;

struct Randomized {
  // Where things are: applied in order at each reset.
  std::vector<Randomization> randomizations;
  std::vector<Distractors> distractors;
  std::vector<PhysicsChange> physics;
  std::vector<AppearanceChange> appearance;
};

// Reads the list; `parts` are the names of the scene's parts. Throws InputError.
Randomized ReadRandomized(const YamlValue& value, const std::vector<std::string>& parts);

// A name that must be one of `parts`, which `value` contains. Throws InputError.
std::string PartName(const std::string& name, const YamlValue& value, const std::vector<std::string>& parts);
std::string PartName(const YamlValue& value, const std::vector<std::string>& parts);

// A position of a joint under one of the keys STEM_deg, STEM_rad and STEM_m, and whether it is an angle.
// Throws InputError.
struct JointPosition {
  double position;
  bool is_angle;
};
JointPosition ReadJointPosition(const YamlMap& map, const std::string& stem);

}  // namespace evalbus
