#include <algorithm>
#include <cmath>
#include <map>

#include "base/errors.h"
#include "metrics/task/expressions.h"

namespace evalbus::metrics {
namespace {

// Distance (m) between two points: a gripper's is the wrist of its arm, anything else's the origin of its
// body.
class Distance : public Quantity {
 public:
  Distance(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"a", "b"});
    a_ = CompilePoint(arguments["a"], context);
    b_ = CompilePoint(arguments["b"], context);
  }
  double Evaluate(const WorldView& world) override {
    const double *a = Position(a_, world), *b = Position(b_, world);
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  }

 private:
  struct Point {
    bool is_wrist;
    int index;  // arm or body
  };
  static Point CompilePoint(const YamlValue& argument, const CompileContext& context) {
    // An arm and its gripper may have one name; the wrist is then what is meant.
    const int gripper = context.names.FindGripper(argument.Text());
    if (gripper >= 0) return {true, context.names.model().gripper[gripper].arm};
    return {false, context.names.Body(argument.Text(), argument.location())};
  }
  static const double* Position(const Point& point, const WorldView& world) {
    return point.is_wrist ? world.state.arm[point.index].wrist_position_m
                          : world.state.body_position_m[point.index].data();
  }
  Point a_;
  Point b_;
};

// Height (m) of an object's origin above where the task's scene puts it.
class Lift : public Quantity {
 public:
  Lift(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"object"});
    const SourceLocation where = arguments["object"].location();
    const std::string object = arguments["object"].Text();
    body_ = context.names.Body(object, where);
    const auto& parts = context.task.parts;
    const auto part =
        std::find_if(parts.begin(), parts.end(), [&](const ScenePart& p) { return p.name == object; });
    if (part == parts.end()) {
      throw InputError(where.ToString() + ": 'lift' needs a part of the scene, '" + object + "' is none");
    }
    start_ = part->pose.position[2];
  }
  double Evaluate(const WorldView& world) override { return world.state.body_position_m[body_][2] - start_; }

 private:
  int body_;
  double start_;
};

class JointFractionOf : public Quantity {
 public:
  JointFractionOf(const Expression& expression, const CompileContext& context)
      : fraction_(ArgumentsOf(expression, {"joint"}), context) {}
  double Evaluate(const WorldView& world) override { return fraction_.Of(world.state); }

 private:
  JointFraction fraction_;
};

class TiltOf : public Quantity {
 public:
  TiltOf(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"object"}, {"axis"});
    body_ = context.names.Body(arguments["object"].Text(), arguments["object"].location());
    axis_ = TiltAxis(arguments);
  }
  double Evaluate(const WorldView& world) override { return Tilt(world.state.body_quat_wxyz[body_], axis_); }

 private:
  int body_;
  int axis_;
};

using Factory = std::unique_ptr<Quantity> (*)(const Expression&, const CompileContext&);

template <typename T>
std::unique_ptr<Quantity> Make(const Expression& expression, const CompileContext& context) {
  return std::make_unique<T>(expression, context);
}

const std::map<std::string, Factory> kRegistry = {
    {"distance", Make<Distance>},
    {"joint_fraction", Make<JointFractionOf>},
    {"lift", Make<Lift>},
    {"tilt", Make<TiltOf>},
};

}  // namespace

std::unique_ptr<Quantity> CompileQuantity(const Expression& expression, const CompileContext& context) {
  const auto factory = kRegistry.find(expression.name);
  if (factory != kRegistry.end()) return factory->second(expression, context);
  std::string known;
  for (const auto& [name, unused] : kRegistry) known += (known.empty() ? "" : ", ") + name;
  throw InputError(expression.location().ToString() + ": no quantity is called '" + expression.name +
                   "'; expected " + known);
}

}  // namespace evalbus::metrics
