// The predicates and quantities that task descriptions are made of. Each is a class in predicates.cc or
// quantities.cc and one line in the registry there; docs/metrics.md lists their names and arguments.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
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
  virtual double Evaluate(const WorldView& world) = 0;
};

// What expressions are compiled against. Both must outlive what is compiled.
struct CompileContext {
  const ModelNames& names;
  const TaskDescription& task;
};

// Throw InputError with file and line: an unknown predicate or quantity, argument or name.
std::unique_ptr<Predicate> CompilePredicate(const Expression& expression, const CompileContext& context);
std::unique_ptr<Quantity> CompileQuantity(const Expression& expression, const CompileContext& context);

// The arguments of an expression, each of which must be known. Throws InputError with file and line.
YamlMap ArgumentsOf(const Expression& expression, std::initializer_list<const char*> required,
                    std::initializer_list<const char*> optional = {});

// A lower and an upper limit, at least one of which must be given; both keys must be among the optional ones.
// Infinite where not given. Throws InputError.
std::array<double, 2> Limits(const YamlMap& arguments, const std::string& min, const std::string& max);

// True where a geom of one set touches a geom of the other; sets by geom id.
bool Touch(std::span<const contact_t> contacts, const std::vector<uint8_t>& a, const std::vector<uint8_t>& b);

// A hinge or slide with a range, as a fraction of it: 0 at its lower end, 1 at its upper one.
class JointFraction {
 public:
  // Argument `joint`. Throws InputError for a joint without a range.
  JointFraction(const YamlMap& arguments, const CompileContext& context);
  double Of(const state_t& state) const { return (state.qpos_mixed[coordinate_] - lower_) / range_; }

 private:
  int coordinate_;
  double lower_, range_;
};

// How far an object leans: the angle (rad) between its up axis (z of its body) and the vertical, or with
// `axis` (0 x, 1 y) how far its up axis is from being perpendicular to that world axis, |phi - pi/2|.
double Tilt(const std::vector<double>& quat_wxyz, int axis);
inline constexpr int kNoAxis = -1;
// Argument `axis` (x or y, optional) as for Tilt().
int TiltAxis(const YamlMap& arguments);

}  // namespace evalbus::metrics
