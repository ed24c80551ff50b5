// Predicates and quantities from which task descriptions are built. Each is a class in predicates.cc or
// quantities.cc with one line in the registry of that file. docs/metrics.md lists their names and arguments.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "metrics/sample/sample.h"
#include "metrics/task/predicate.h"
#include "models/expression.h"
#include "models/model_names.h"
#include "models/task_description.h"
#include "models/yaml_reader.h"

namespace evalbus::metrics {

// A number computed from a tick, in SI units.
class Quantity {
 public:
  virtual ~Quantity() = default;
  // Discards the state of the previous episode.
  virtual void Start() {}
  virtual double Evaluate(const WorldView& world) = 0;
  // Returns Evaluate(). Throws InputError if it is NaN, which only a plugin can return.
  double Number(const WorldView& world);

  // Returns a description of the number, such as "tilt of pot".
  const std::string& words() const { return words_; }
  // Returns the object or arm to which the number belongs, as named in the task description.
  const std::string& subject() const { return subject_; }

 protected:
  std::string words_;
  std::string subject_;
};

// Context in which expressions are compiled. Both references must outlive the compiled expressions.
struct CompileContext {
  const ModelNames& names;
  const TaskDescription& task;
  // The predicate `reached` may refer only to the first num_stages stages. While a stage is compiled, this is
  // the number of stages before it.
  size_t num_stages = std::numeric_limits<size_t>::max();
};

// Both functions throw InputError with file and line for an unknown predicate, quantity, argument or name,
// and for a limit outside the range of the number.
std::unique_ptr<Predicate> CompilePredicate(const Expression& expression, const CompileContext& context);
std::unique_ptr<Quantity> CompileQuantity(const Expression& expression, const CompileContext& context);

// Registers a predicate under this name; must be called before any task is read (docs/extending.md). Throws
// InputError if the name is taken.
using PredicateMaker = std::function<std::unique_ptr<Predicate>(const Expression&, const CompileContext&)>;
void RegisterPredicate(const std::string& name, const PredicateMaker& make);

// A quantity that tasks may use as a metric under `target_distance` or `pose_error` and, with limits, as a
// predicate.
struct QuantityKind {
  std::string name;
  std::vector<const char*> required_arguments;
  std::vector<const char*> optional_arguments;
  // Unit of the limits: as in the keys of a task ("m" in "min_m" and "max_m"), and as shown in texts. If the
  // key is "rad", tasks may use "deg" too.
  std::string key;
  std::string unit;
  // Valid range of the number, in the unit.
  NumberRange range;
  // Kind as in condition_t.
  int8_t kind;
  std::function<std::unique_ptr<Quantity>(const YamlMap& arguments, const CompileContext& context)> make;
};
// Registers a quantity; must be called before any task is read. Throws InputError if the name is taken.
void RegisterQuantity(const QuantityKind& kind);

// Compiles any quantity into a predicate that is true if the number is within the limits given by the
// arguments min_UNIT and max_UNIT. Null if no quantity has this name.
std::unique_ptr<Predicate> CompileWithin(const Expression& expression, const CompileContext& context);

// Return all names in alphabetical order. Every quantity is also a predicate.
std::vector<std::string> PredicateNames();
std::vector<std::string> QuantityNames();

// Returns the arguments of an expression after checking that the required ones are present and that all are
// known. Throws InputError with file and line.
YamlMap ArgumentsOf(const Expression& expression, const std::vector<const char*>& required,
                    const std::vector<const char*>& optional = {});

// Returns whether a geom of set a touches a geom of set b; sets are indexed by geom id.
bool Touch(std::span<const contact_t> contacts, const std::vector<uint8_t>& a, const std::vector<uint8_t>& b);

// Rotates a vector by a unit quaternion (MuJoCo's are normalized).
std::array<double, 3> Rotated(const std::array<double, 3>& v, const double* quat_wxyz);

// Reference frame of a position: the world frame, or the frame of the body named by the argument `frame`.
class Frame {
 public:
  Frame(const YamlMap& arguments, const CompileContext& context);
  // Transforms a point from world coordinates to this frame.
  std::array<double, 3> Of(const double* position, const WorldView& world) const;
  // Returns a description, such as " in the frame of plate"; empty for the world frame.
  const std::string& words() const { return words_; }

 private:
  int body_ = -1;  // -1: the world
  std::string words_;
};

// Returns the tilt of an object: the angle (rad) between its up axis (z of its body) and the vertical. With
// `axis` (0: x, 1: y), the tilt is |phi - pi/2|, where phi is the angle between its up axis and that world
// axis.
double Tilt(const double* quat_wxyz, int axis);
inline constexpr int kNoAxis = -1;
// Reads the optional argument `axis` (x or y) for Tilt().
int TiltAxis(const YamlMap& arguments);

}  // namespace evalbus::metrics
