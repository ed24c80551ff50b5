// The predicates and quantities that task descriptions are made of. Each is a class in predicates.cc or
// quantities.cc and one line in the registry there; docs/metrics.md lists their names and arguments.
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

// A number about a tick, in SI units.
class Quantity {
 public:
  virtual ~Quantity() = default;
  // Forgets the episode before.
  virtual void Start() {}
  virtual double Evaluate(const WorldView& world) = 0;

  // What the number is, in words: "tilt of pot".
  const std::string& words() const { return words_; }
  // What it is about, as the task description names it.
  const std::string& subject() const { return subject_; }

 protected:
  std::string words_;
  std::string subject_;
};

// What expressions are compiled against. Both must outlive what is compiled.
struct CompileContext {
  const ModelNames& names;
  const TaskDescription& task;
  // `reached` may ask for the first so many stages of the task: of a stage, for those before it.
  size_t num_stages = std::numeric_limits<size_t>::max();
};

// Throw InputError with file and line: an unknown predicate or quantity, argument or name, a limit that the
// number never passes.
std::unique_ptr<Predicate> CompilePredicate(const Expression& expression, const CompileContext& context);
std::unique_ptr<Quantity> CompileQuantity(const Expression& expression, const CompileContext& context);

// Adds a predicate by this name, before any task is read (docs/extending.md). Throws InputError: the name is
// taken.
using PredicateMaker = std::function<std::unique_ptr<Predicate>(const Expression&, const CompileContext&)>;
void RegisterPredicate(const std::string& name, const PredicateMaker& make);

// A quantity that tasks may name: as a metric under `target_distance`, and as a predicate with limits.
struct QuantityKind {
  std::string name;
  std::vector<const char*> required_arguments;
  std::vector<const char*> optional_arguments;
  // Of limits, as the keys of a task have them ("min_m", "max_m") and as people read them; "rad" is "deg",
  // too.
  std::string key;
  std::string unit;
  // What the number can be, in the unit.
  NumberRange range;
  // condition_t's.
  int8_t kind;
  std::function<std::unique_ptr<Quantity>(const YamlMap& arguments, const CompileContext& context)> make;
};
// As RegisterPredicate.
void RegisterQuantity(const QuantityKind& kind);

// Of every quantity a predicate: it is within limits, min_UNIT and max_UNIT among the arguments. Null where
// no quantity has this name.
std::unique_ptr<Predicate> CompileWithin(const Expression& expression, const CompileContext& context);

// Sorted. Every quantity is a predicate, too.
std::vector<std::string> PredicateNames();
std::vector<std::string> QuantityNames();

// The arguments of an expression, each of which must be known. Throws InputError with file and line.
YamlMap ArgumentsOf(const Expression& expression, const std::vector<const char*>& required,
                    const std::vector<const char*>& optional = {});

// True where a geom of one set touches a geom of the other; sets by geom id.
bool Touch(std::span<const contact_t> contacts, const std::vector<uint8_t>& a, const std::vector<uint8_t>& b);

// Where a body's frame is: the world's, or that of the body which the argument `frame` names.
class Frame {
 public:
  Frame(const YamlMap& arguments, const CompileContext& context);
  // A point of the world in this frame.
  std::array<double, 3> Of(const double* position, const WorldView& world) const;
  // " in the frame of plate"; nothing for the world.
  const std::string& words() const { return words_; }

 private:
  int body_ = -1;  // -1: the world
  std::string words_;
};

// How far an object leans: the angle (rad) between its up axis (z of its body) and the vertical, or with
// `axis` (0 x, 1 y) how far its up axis is from being perpendicular to that world axis, |phi - pi/2|.
double Tilt(const double* quat_wxyz, int axis);
inline constexpr int kNoAxis = -1;
// Argument `axis` (x or y, optional) as for Tilt().
int TiltAxis(const YamlMap& arguments);

}  // namespace evalbus::metrics
