// Randomization of a task variation, from the list `randomize` of its YAML file.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/source_location.h"
#include "models/yaml_reader.h"

namespace evalbus {

// Uniform position in a box around `center`, at least min_distance from every other free or placed part. The
// height is not changed.
struct SpawnBox {
  std::string object;
  std::array<double, 2> center{};        // x, y, m
  std::array<double, 2> half_extents{};  // x, y, m
  double min_distance = 0;               // m
};

// Random points of a grid around `origin`. With half extents ex and ey and spacing s, the grid has 2 ex // s
// by 2 ey // s points (Python's //). Every object gets a different point, plus a uniform jitter of up to
// +-jitter per axis.
struct SpawnPlane {
  std::vector<std::string> objects;
  std::array<double, 3> origin{};        // m
  std::array<double, 2> half_extents{};  // m
  double spacing = 0;                    // m
  std::array<double, 3> jitter{};        // m
  SourceLocation location{};
};

// Uniform rotation in +-bound about world z, added to the part's base orientation.
struct SpawnYaw {
  std::string object;
  double bound = 0;  // rad
};

// Uniform initial position of a joint, rad or m.
struct SpawnJoint {
  std::string joint;
  bool is_angle = false;
  double min = 0, max = 0;
  SourceLocation location;
};

using Randomization = std::variant<SpawnBox, SpawnPlane, SpawnYaw, SpawnJoint>;

// A random number of free parts, uniform from min to max. They are placed uniformly in a box around `center`,
// with a uniform rotation about the vertical and unchanged height. The remaining parts are moved far away.
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

// The following structs describe changes of the model itself at each episode (randomized_model.h). `of` lists
// parts or bodies; each includes everything attached to it. One draw applies to all of them.

// Multiplies mass and inertia by a factor.
struct RandomMass {
  std::vector<NameInFile> of;
  Span factor;
};

// Multiplies the friction coefficients of geoms by a factor.
struct RandomFriction {
  std::vector<NameInFile> of;
  Span factor;
};

// Sets the color of materials, or of geoms without a material. Each of red, green and blue is uniform between
// min and max.
struct RandomColor {
  std::vector<NameInFile> of;
  std::array<double, 3> min{}, max{};
};

// Changes a light. At least one of the three changes is given.
struct RandomLight {
  NameInFile name;
  // Multiplies the brightness.
  std::optional<Span> factor;
  // Shifts the light by up to this along each axis of the frame on which it is mounted, m.
  std::optional<std::array<double, 3>> shift;
  // Rotates the light's direction by up to this about each axis of that frame, rad. A directional light of
  // the world is rotated about the scene's center, so that its shadows remain within the scene.
  std::optional<double> turn;
};

// Replaces the texture of everything in `of` that has a texture. If nothing in `of` has a texture, everything
// in it that has a material gets one. All choices are equally likely.
struct RandomTexture {
  std::vector<NameInFile> of;
  // Names of the scene's textures, names or files as in TextureFile(), or kPlain (models/texture_files.h).
  std::vector<NameInFile> choices;
};

// Shifts a camera by up to `shift` along each axis of the frame on which it is mounted, and rotates it by up
// to `turn` about each of its own axes.
struct RandomCamera {
  NameInFile name;
  std::array<double, 3> shift{};  // m
  double turn = 0;                // rad
};

using PhysicsChange = std::variant<RandomMass, RandomFriction>;
using AppearanceChange = std::variant<RandomColor, RandomLight, RandomTexture, RandomCamera>;

struct Randomized {
  // Initial positions; applied in order at each reset.
  std::vector<Randomization> randomizations;
  std::vector<Distractors> distractors;
  std::vector<PhysicsChange> physics;
  std::vector<AppearanceChange> appearance;
};

// Reads the list. `parts`: names of the scene's parts. Throws InputError.
Randomized ReadRandomized(const YamlValue& value, const std::vector<std::string>& parts);

// Returns the name if it is one of `parts`. Otherwise throws InputError at `value`.
std::string PartName(const std::string& name, const YamlValue& value, const std::vector<std::string>& parts);
std::string PartName(const YamlValue& value, const std::vector<std::string>& parts);

// A joint position, read from one of the keys STEM_deg, STEM_rad and STEM_m, and whether it is an angle.
// Reading throws InputError.
struct JointPosition {
  double position;
  bool is_angle;
};
JointPosition ReadJointPosition(const YamlMap& map, const std::string& stem);

}  // namespace evalbus
