#include <map>

#include "bus/errors.h"
#include "metrics/task/expressions.h"

namespace evalbus {
namespace {

// A pad of the gripper touches the object; gripper `any`: of any gripper.
class Holding : public Predicate {
 public:
  Holding(const Expression& expression, const CompileContext& context) {
    const Arguments arguments(expression, {"gripper", "object"});
    const auto &gripper = arguments["gripper"], &object = arguments["object"];
    object_ = context.names.Geoms(object.value, object.location);
    if (gripper.value == "any") {
      pads_.resize(object_.size());
      for (int k = 0; k < context.names.model().num_grippers; ++k) {
        for (int32_t geom : context.names.model().gripper[k].pad_geom) pads_[geom] = 1;
      }
    } else {
      pads_ = context.names.Pads(context.names.Gripper(gripper.value, gripper.location));
    }
  }
  bool Evaluate(const WorldView& world) override { return Touch(world.contacts, pads_, object_); }

 private:
  std::vector<uint8_t> pads_;
  std::vector<uint8_t> object_;
};

class Touching : public Predicate {
 public:
  Touching(const Expression& expression, const CompileContext& context) {
    const Arguments arguments(expression, {"a", "b"});
    a_ = context.names.Geoms(arguments["a"].value, arguments["a"].location);
    b_ = context.names.Geoms(arguments["b"].value, arguments["b"].location);
  }
  bool Evaluate(const WorldView& world) override { return Touch(world.contacts, a_, b_); }

 private:
  std::vector<uint8_t> a_;
  std::vector<uint8_t> b_;
};

// The object's origin is at world height min_m or higher.
class HeightAbove : public Predicate {
 public:
  HeightAbove(const Expression& expression, const CompileContext& context) {
    const Arguments arguments(expression, {"object", "min_m"});
    body_ = context.names.Body(arguments["object"].value, arguments["object"].location);
    min_ = arguments.Number("min_m");
  }
  bool Evaluate(const WorldView& world) override { return world.state.body_position_m[body_][2] >= min_; }

 private:
  int body_;
  double min_;
};

// The object is not upside down and its tilt (see Tilt) is at most the limit.
class TiltBelow : public Predicate {
 public:
  TiltBelow(const Expression& expression, const CompileContext& context) {
    const Arguments arguments(expression, {"object"}, {"axis", "max_deg", "max_rad"});
    body_ = context.names.Body(arguments["object"].value, arguments["object"].location);
    axis_ = TiltAxis(arguments);
    max_ = arguments.Angle("max");
  }
  bool Evaluate(const WorldView& world) override {
    const std::vector<double>& quat = world.state.body_quat_wxyz[body_];
    const double up_z = quat[0] * quat[0] - quat[1] * quat[1] - quat[2] * quat[2] + quat[3] * quat[3];
    return up_z >= 0 && Tilt(quat, axis_) <= max_;
  }

 private:
  int body_;
  int axis_;
  double max_;
};

// Every operand is evaluated at every tick: a latched one must see them all.
class Combination : public Predicate {
 public:
  Combination(const Expression& expression, const CompileContext& context) {
    if (!expression.arguments.empty() || expression.operands.empty()) {
      throw InputError(expression.location.ToString() + ": '" + expression.name +
                       "' needs predicates, as in " + expression.name + ": [{touching: {a: pot, b: world}}]");
    }
    for (const Expression& operand : expression.operands)
      operands_.push_back(CompilePredicate(operand, context));
  }
  void Start() override {
    for (const auto& operand : operands_) operand->Start();
  }

 protected:
  int CountTrue(const WorldView& world) {
    int count = 0;
    for (const auto& operand : operands_) count += operand->Evaluate(world);
    return count;
  }
  void NeedOne(const Expression& expression) const {
    if (operands_.size() == 1) return;
    throw InputError(expression.location.ToString() + ": '" + expression.name +
                     "' needs exactly one predicate");
  }
  std::vector<std::unique_ptr<Predicate>> operands_;
};

class All : public Combination {
 public:
  using Combination::Combination;
  bool Evaluate(const WorldView& world) override {
    return CountTrue(world) == static_cast<int>(operands_.size());
  }
};

class Any : public Combination {
 public:
  using Combination::Combination;
  bool Evaluate(const WorldView& world) override { return CountTrue(world) > 0; }
};

class Not : public Combination {
 public:
  Not(const Expression& expression, const CompileContext& context) : Combination(expression, context) {
    NeedOne(expression);
  }
  bool Evaluate(const WorldView& world) override { return CountTrue(world) == 0; }
};

// True from the first tick on at which its operand is.
class Latched : public Combination {
 public:
  Latched(const Expression& expression, const CompileContext& context) : Combination(expression, context) {
    NeedOne(expression);
  }
  void Start() override {
    Combination::Start();
    latched_ = false;
  }
  bool Evaluate(const WorldView& world) override {
    latched_ |= CountTrue(world) > 0;
    return latched_;
  }

 private:
  bool latched_ = false;
};

using Factory = std::unique_ptr<Predicate> (*)(const Expression&, const CompileContext&);

template <typename T>
std::unique_ptr<Predicate> Make(const Expression& expression, const CompileContext& context) {
  return std::make_unique<T>(expression, context);
}

const std::map<std::string, Factory> kRegistry = {
    {"all", Make<All>},
    {"any", Make<Any>},
    {"height_above", Make<HeightAbove>},
    {"holding", Make<Holding>},
    {"latched", Make<Latched>},
    {"not", Make<Not>},
    {"tilt_below", Make<TiltBelow>},
    {"touching", Make<Touching>},
};

}  // namespace

std::unique_ptr<Predicate> CompilePredicate(const Expression& expression, const CompileContext& context) {
  const auto factory = kRegistry.find(expression.name);
  if (factory != kRegistry.end()) return factory->second(expression, context);
  std::string known;
  for (const auto& [name, unused] : kRegistry) known += (known.empty() ? "" : ", ") + name;
  throw InputError(expression.location.ToString() + ": no predicate is called '" + expression.name +
                   "'; expected " + known);
}

}  // namespace evalbus
