#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/angles.h"
#include "base/errors.h"
#include "lcmtypes/clock.h"
#include "metrics/task/expressions.h"

namespace evalbus::metrics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

int BodyOf(const YamlValue& operand, const CompileContext& context) {
  return context.names.Body(operand.Text(), operand.location());
}

// Distance (m) between two points. The point of a gripper is the wrist of its arm. The point of anything else
// is the origin of its body. For b, `b_point_m` selects another point in the body's frame.
class Distance : public Quantity {
 public:
  Distance(const YamlMap& arguments, const CompileContext& context)
      : a_(CompilePoint(arguments["a"], context)), b_(CompilePoint(arguments["b"], context)) {
    subject_ = arguments["a"].Text();
    words_ = "distance of " + subject_ + " from " + arguments["b"].Text();
    if (const YamlValue* point = arguments.Find("b_point_m")) {
      if (b_.is_wrist) point->Fail("requires a body as 'b'; '" + arguments["b"].Text() + "' is a gripper");
      b_point_ = point->Vector<3>();
      has_b_point_ = true;
    } else if (a_ == b_) {
      arguments["b"].Fail("expected something other than 'a'");
    }
  }
  double Evaluate(const WorldView& world) override {
    const double *a = Position(a_, world), *b = Position(b_, world);
    std::array<double, 3> shift{};
    if (has_b_point_) shift = Rotated(b_point_, world.state.body[b_.index].quat_wxyz);
    return std::hypot(a[0] - b[0] - shift[0], a[1] - b[1] - shift[1], a[2] - b[2] - shift[2]);
  }

 private:
  struct Point {
    bool is_wrist;
    int index;  // arm or body
    bool operator==(const Point&) const = default;
  };
  static Point CompilePoint(const YamlValue& argument, const CompileContext& context) {
    // If an arm and its gripper share a name, the name refers to the wrist.
    const int gripper = context.names.FindGripper(argument.Text());
    if (gripper >= 0) return {true, context.names.model().gripper[gripper].arm};
    return {false, BodyOf(argument, context)};
  }
  static const double* Position(const Point& point, const WorldView& world) {
    return point.is_wrist ? world.state.arm[point.index].wrist_position_m
                          : world.state.body[point.index].position_m;
  }
  Point a_;
  Point b_;
  bool has_b_point_ = false;
  std::array<double, 3> b_point_{};
};

// Position of a hinge or slide joint as a fraction of its range: 0 at the lower end, 1 at the upper end.
class JointFraction : public Quantity {
 public:
  JointFraction(const YamlMap& arguments, const CompileContext& context) {
    const YamlValue& name = arguments["joint"];
    const model_info_t& model = context.names.model();
    const int joint = context.names.Joint(name.Text(), name.location());
    coordinate_ = model.joint_qpos_index[joint];
    lower_ = model.joint_lower_mixed[joint];
    range_ = model.joint_upper_mixed[joint] - lower_;
    if (!(range_ > 0)) {
      throw InputError(name.location().ToString() + ": joint '" + name.Text() +
                       "' has no range, but this quantity requires one");
    }
    subject_ = name.Text();
    words_ = "fraction of the range of " + subject_;
  }
  double Evaluate(const WorldView& world) override {
    return (world.state.qpos_mixed[coordinate_] - lower_) / range_;
  }

 private:
  int coordinate_;
  double lower_, range_;
};

// Speed (rad/s) of the fastest joint of an arm, or of all arms with `all`.
class JointSpeed : public Quantity {
 public:
  JointSpeed(const YamlMap& arguments, const CompileContext& context) {
    const YamlValue& wanted = arguments["arm"];
    const model_info_t& model = context.names.model();
    std::vector<std::string> known = {"all"};
    for (int k = 0; k < model.num_arms; ++k) {
      known.push_back(model.arm[k].name);
      if (wanted.Text() == "all" || wanted.Text() == known.back()) arms_.push_back(k);
    }
    if (arms_.empty())
      wanted.Fail("there is no arm '" + wanted.Text() + "'" + Suggestion(wanted.Text(), known));
    subject_ = wanted.Text();
    words_ = "fastest joint of " + (subject_ == "all" ? "the robot" : subject_);
  }
  double Evaluate(const WorldView& world) override {
    double fastest = 0;
    for (const int arm : arms_) {
      for (const double speed : world.state.arm[arm].joint_velocity_radps)
        fastest = std::max(fastest, std::abs(speed));
    }
    return fastest;
  }

 private:
  std::vector<int> arms_;
};

// Height (m) of an object's origin above `rest_height_m`, which is the origin's height in the task's scene by
// default.
class Lift : public Quantity {
 public:
  Lift(const YamlMap& arguments, const CompileContext& context)
      : body_(BodyOf(arguments["object"], context)) {
    subject_ = arguments["object"].Text();
    const auto part = std::ranges::find(context.task.parts, subject_, &ScenePart::name);
    if (part == context.task.parts.end()) {
      throw InputError(arguments["object"].location().ToString() +
                       ": 'lift' requires a part of the scene; '" + subject_ + "' is not one");
    }
    const YamlValue* rest = arguments.Find("rest_height_m");
    rest_height_ = rest ? rest->Number() : part->pose.position[2];
    words_ = "lift of " + subject_;
  }
  double Evaluate(const WorldView& world) override {
    return world.state.body[body_].position_m[2] - rest_height_;
  }

 private:
  int body_;
  double rest_height_;
};

// One coordinate (m) of an object's origin, in the world frame or in the frame of a body.
class Position : public Quantity {
 public:
  Position(const YamlMap& arguments, const CompileContext& context)
      : body_(BodyOf(arguments["object"], context)), frame_(arguments, context) {
    const std::string axis = arguments["axis"].Text();
    if (axis != "x" && axis != "y" && axis != "z") {
      arguments["axis"].Fail("expected x, y or z, got '" + axis + "'");
    }
    axis_ = static_cast<size_t>(axis[0] - 'x');
    subject_ = arguments["object"].Text();
    words_ = axis + " of " + subject_ + frame_.words();
  }
  double Evaluate(const WorldView& world) override {
    return frame_.Of(world.state.body[body_].position_m, world)[axis_];
  }

 private:
  int body_;
  Frame frame_;
  size_t axis_;
};

// Speed (m/s) of an object's origin from the previous tick to this one; 0 at the first tick, because
// everything starts at rest.
class Speed : public Quantity {
 public:
  Speed(const YamlMap& arguments, const CompileContext& context)
      : body_(BodyOf(arguments["object"], context)) {
    subject_ = arguments["object"].Text();
    words_ = "speed of " + subject_;
  }
  void Start() override { last_.reset(); }
  double Evaluate(const WorldView& world) override {
    const double* p = world.state.body[body_].position_m;
    const Seen seen{world.state.header.sim_time_us, {p[0], p[1], p[2]}};
    const Seen last = last_.value_or(seen);
    last_ = seen;
    if (seen.time_us <= last.time_us) return 0;
    const std::array<double, 3>&a = seen.position, &b = last.position;
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) / Seconds(seen.time_us - last.time_us);
  }

 private:
  struct Seen {
    int64_t time_us;
    std::array<double, 3> position;
  };
  int body_;
  std::optional<Seen> last_;
};

class TiltOf : public Quantity {
 public:
  TiltOf(const YamlMap& arguments, const CompileContext& context)
      : body_(BodyOf(arguments["object"], context)), axis_(TiltAxis(arguments)) {
    subject_ = arguments["object"].Text();
    words_ = "tilt of " + subject_;
  }
  double Evaluate(const WorldView& world) override { return Tilt(world.state.body[body_].quat_wxyz, axis_); }

 private:
  int body_;
  int axis_;
};

template <class T>
QuantityKind KindOf(const char* name, std::vector<const char*> required, std::vector<const char*> optional,
                    const char* key, const char* unit, const NumberRange& range, int8_t kind) {
  const auto make = [](const YamlMap& arguments, const CompileContext& context) {
    return std::make_unique<T>(arguments, context);
  };
  return {name, std::move(required), std::move(optional), key, unit, range, kind, make};
}

std::vector<QuantityKind>& Quantities() {
  using C = condition_t;
  static std::vector<QuantityKind> kinds = {
      KindOf<Distance>("distance", {"a", "b"}, {"b_point_m"}, "m", "m", kNotNegative, C::POSE),
      KindOf<JointFraction>("joint_fraction", {"joint"}, {}, "", "1", {.min = 0, .max = 1}, C::PROGRESS),
      KindOf<JointSpeed>("joint_speed", {"arm"}, {}, "radps", "rad/s", kNotNegative, C::PROGRESS),
      KindOf<Lift>("lift", {"object"}, {"rest_height_m"}, "m", "m", kAnyNumber, C::PROGRESS),
      KindOf<Position>("position", {"object", "axis"}, {"frame"}, "m", "m", kAnyNumber, C::POSE),
      KindOf<Speed>("speed", {"object"}, {}, "mps", "m/s", kNotNegative, C::PROGRESS),
      KindOf<TiltOf>("tilt", {"object"}, {"axis"}, "deg", "deg", {.min = 0, .max = 180}, C::POSE),
  };
  return kinds;
}

const QuantityKind* Find(const std::string& name) {
  const auto kind = std::ranges::find(Quantities(), name, &QuantityKind::name);
  return kind == Quantities().end() ? nullptr : &*kind;
}

std::unique_ptr<Quantity> Make(const QuantityKind& kind, const YamlMap& arguments,
                               const CompileContext& context) {
  std::unique_ptr<Quantity> quantity = kind.make(arguments, context);
  if (!quantity) throw InputError("quantity '" + kind.name + "': its plugin returned none");
  return quantity;
}

// True if a quantity is within its limits, at least one of which is given.
class QuantityWithin : public Within {
 public:
  QuantityWithin(const QuantityKind& kind, const Expression& expression, const CompileContext& context) {
    const std::string suffix = kind.key.empty() ? "" : "_" + kind.key;
    const std::string min = "min" + suffix, max = "max" + suffix;
    std::vector<const char*> optional = kind.optional_arguments;
    optional.insert(optional.end(), {min.c_str(), max.c_str()});
    if (kind.key == "deg") optional.insert(optional.end(), {"min_rad", "max_rad"});
    const YamlMap arguments = ArgumentsOf(expression, kind.required_arguments, optional);
    quantity_of_ = Make(kind, arguments, context);
    scale_ = kind.key == "deg" ? ToDegrees(1) : 1;

    const std::optional<double> lower = Limit(arguments, "min", kind), upper = Limit(arguments, "max", kind);
    if (!lower && !upper) {
      throw InputError(expression.location().ToString() + ": '" + expression.name + "' requires '" + min +
                       "', '" + max + "' or both");
    }
    lower_ = lower.value_or(-kInfinity);
    upper_ = upper.value_or(kInfinity);
    if (lower_ > upper_) {
      throw InputError(expression.location().ToString() + ": '" + expression.name + "' is never true: '" +
                       min + "' is above '" + max + "'");
    }
    condition_.predicate = kind.name;
    condition_.kind = kind.kind;
    condition_.subject = quantity_of_->subject();
    condition_.unit = kind.unit;
    quantity_ = quantity_of_->words();
  }
  void Start() override {
    Within::Start();
    quantity_of_->Start();
  }

 protected:
  double Value(const WorldView& world) override { return quantity_of_->Number(world) * scale_; }

 private:
  // Rejects a limit outside the range of the number, because the predicate would be always true or never
  // true.
  static std::optional<double> Limit(const YamlMap& arguments, const std::string& which,
                                     const QuantityKind& kind) {
    if (kind.key != "deg") {
      const YamlValue* limit = arguments.Find(which + (kind.key.empty() ? "" : "_" + kind.key));
      return limit ? std::optional(limit->Number(kind.range)) : std::nullopt;
    }
    const std::optional<double> limit = arguments.Angle(which, kind.range);
    // Uses the number as written if it is given in degrees.
    const YamlValue* degrees = arguments.Find(which + "_deg");
    return degrees ? degrees->Number() : limit ? std::optional(ToDegrees(*limit)) : std::nullopt;
  }
  std::unique_ptr<Quantity> quantity_of_;
  // Factor from SI units to the condition's unit.
  double scale_;
};

}  // namespace

double Quantity::Number(const WorldView& world) {
  const double number = Evaluate(world);
  if (!std::isnan(number)) return number;
  throw InputError(fmt::format("{} is NaN at tick {}", words_, world.state.header.tick));
}

void RegisterQuantity(const QuantityKind& kind) {
  const std::vector<std::string> taken = PredicateNames();
  if (std::ranges::find(taken, kind.name) != taken.end()) {
    throw InputError("there is already a predicate or quantity '" + kind.name + "'");
  }
  Quantities().push_back(kind);
}

std::vector<std::string> QuantityNames() {
  std::vector<std::string> names;
  for (const QuantityKind& kind : Quantities()) names.emplace_back(kind.name);
  return names;
}

std::unique_ptr<Quantity> CompileQuantity(const Expression& expression, const CompileContext& context) {
  if (const QuantityKind* kind = Find(expression.name)) {
    return Make(*kind, ArgumentsOf(expression, kind->required_arguments, kind->optional_arguments), context);
  }
  throw InputError(expression.location().ToString() + ": there is no quantity '" + expression.name + "'" +
                   Suggestion(expression.name, QuantityNames()));
}

std::unique_ptr<Predicate> CompileWithin(const Expression& expression, const CompileContext& context) {
  const QuantityKind* kind = Find(expression.name);
  return kind ? std::make_unique<QuantityWithin>(*kind, expression, context) : nullptr;
}

}  // namespace evalbus::metrics
