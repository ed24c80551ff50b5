#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "base/angles.h"
#include "base/errors.h"
#include "lcmtypes/clock.h"
#include "metrics/task/expressions.h"

namespace evalbus::metrics {
namespace {

condition_t About(const char* predicate, int8_t kind, const std::string& subject = "",
                  const std::string& other = "", const char* unit = "") {
  condition_t condition{};
  condition.predicate = predicate;
  condition.kind = kind;
  condition.subject = subject;
  condition.other = other;
  condition.unit = unit;
  return condition;
}

// Returns the geoms with the argument's name. Throws InputError if there are none, because a contact with
// them would never exist.
std::vector<uint8_t> GeomsOf(const YamlValue& argument, const CompileContext& context) {
  std::vector<uint8_t> geoms = context.names.Geoms(argument.Text(), argument.location());
  if (std::ranges::find(geoms, uint8_t{1}) == geoms.end())
    argument.Fail("'" + argument.Text() + "' has no geom that collides, so it never touches anything");
  return geoms;
}

// A pad of the gripper touches the object. `any` stands for any gripper. `first` stands for the gripper that
// first held the object in this episode; if two began at the same tick, the first of them in the model.
// `other` stands for any gripper except `first`, once the object has been held.
class Holding : public Relation {
 public:
  Holding(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"gripper", "object"});
    const std::string gripper = arguments["gripper"].Text(), object = arguments["object"].Text();
    const SourceLocation where = arguments["gripper"].location();
    object_ = GeomsOf(arguments["object"], context);
    const int num_grippers = context.names.model().num_grippers;
    if (gripper == "any" || gripper == "first" || gripper == "other") {
      which_ = gripper == "any" ? Which::kNamed : gripper == "first" ? Which::kFirst : Which::kOther;
      for (int k = 0; k < num_grippers; ++k) pads_.push_back(context.names.Pads(k));
    } else {
      pads_.push_back(context.names.Pads(context.names.Gripper(gripper, where)));
    }
    if (which_ == Which::kOther && num_grippers < 2) {
      throw InputError(where.ToString() + ": gripper 'other' requires a robot with two grippers");
    }
    condition_ = About("holding", condition_t::HOLDING, object, gripper);
    const std::string who = gripper == "first"             ? "the first gripper"
                            : gripper == "other"           ? "the other gripper"
                            : gripper.ends_with("gripper") ? gripper
                                                           : gripper + " gripper";
    // The word is "touches", because "holds" would suggest a grasp. The timeline shows grasps as bars.
    text_if_true_ = (gripper == "any" ? "a gripper" : who) + " touches " + object;
    text_if_false_ = gripper == "any" ? "no gripper touches " + object : who + " does not touch " + object;
    Start();
  }
  void Start() override { first_ = pads_.size(); }

 protected:
  bool Holds(const WorldView& world) override {
    bool named = false, first = false, other = false;
    for (size_t k = 0; k < pads_.size(); ++k) {
      if (!Touch(world.contacts, pads_[k], object_)) continue;
      if (first_ == pads_.size()) first_ = k;
      named = true;
      (k == first_ ? first : other) = true;
    }
    return which_ == Which::kNamed ? named : which_ == Which::kFirst ? first : other;
  }

 private:
  enum class Which { kNamed, kFirst, kOther };
  Which which_ = Which::kNamed;
  // Pads of each gripper that may hold the object.
  std::vector<std::vector<uint8_t>> pads_;
  std::vector<uint8_t> object_;
  // Index into pads_ of the gripper that held the object first; pads_.size() if none has.
  size_t first_ = 0;
};

// Relation of two bodies, which the arguments `subject` and `other` name.
class RelationOfBodies : public Relation {
 protected:
  RelationOfBodies(const Expression& expression, const CompileContext& context, const char* subject,
                   const char* other, const char* is, const char* is_not) {
    const YamlMap arguments = ArgumentsOf(expression, {subject, other});
    subject_ = GeomsOf(arguments[subject], context);
    other_ = GeomsOf(arguments[other], context);
    if (subject_ == other_)
      arguments[other].Fail("expected something other than '" + std::string(subject) + "'");
    condition_ = About(expression.name.c_str(), condition_t::CONTACT, arguments[subject].Text(),
                       arguments[other].Text());
    text_if_true_ = condition_.subject + is + condition_.other;
    text_if_false_ = condition_.subject + is_not + condition_.other;
  }
  std::vector<uint8_t> subject_, other_;
};

class Touching : public RelationOfBodies {
 public:
  Touching(const Expression& expression, const CompileContext& context)
      : RelationOfBodies(expression, context, "a", "b", " touches ", " does not touch ") {}

 protected:
  bool Holds(const WorldView& world) override { return Touch(world.contacts, subject_, other_); }
};

// The world z coordinate of the object's origin is at least min_m.
class HeightAbove : public Within {
 public:
  HeightAbove(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"object", "min_m"});
    body_ = context.names.Body(arguments["object"].Text(), arguments["object"].location());
    lower_ = arguments["min_m"].Number();
    condition_ = About("height_above", condition_t::PROGRESS, arguments["object"].Text(), "", "m");
    quantity_ = "height of " + condition_.subject;
  }

 protected:
  double Value(const WorldView& world) override { return world.state.body[body_].position_m[2]; }

 private:
  int body_;
};

// The object rests on the support: one of its geoms touches a geom of the support, and the contact normal is
// within 45 degrees of vertical, pointing up.
class On : public RelationOfBodies {
 public:
  On(const Expression& expression, const CompileContext& context)
      : RelationOfBodies(expression, context, "object", "support", " is on ", " is not on ") {}

 protected:
  bool Holds(const WorldView& world) override {
    return std::ranges::any_of(world.contacts, [&](const contact_t& contact) {
      const std::span<const contact_t> one(&contact, 1);
      if (!Touch(one, subject_, other_)) return false;
      // The contact normal points from geom_a to geom_b.
      return (subject_[static_cast<size_t>(contact.geom_b)] ? 1 : -1) * contact.normal[2] >=
             std::numbers::sqrt2 / 2;
    });
  }
};

// The stage was reached at this tick or earlier.
class Reached : public Relation {
 public:
  Reached(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"stage"});
    std::vector<std::string> stages;
    for (const Stage& stage : context.task.stages) stages.push_back(stage.name);
    stages.resize(std::min(stages.size(), context.num_stages));
    const std::string name = arguments["stage"].Text();
    const auto stage = std::ranges::find(stages, name);
    if (stage == stages.end()) {
      arguments["stage"].Fail(
          "no stage" +
          std::string(context.num_stages < context.task.stages.size() ? " before this one" : "") +
          " is called '" + name + "'" + Suggestion(name, stages));
    }
    stage_ = static_cast<size_t>(stage - stages.begin());
    condition_ = About("reached", condition_t::PROGRESS, name);
    text_if_true_ = "stage " + name + " was reached";
    text_if_false_ = "stage " + name + " was not reached";
  }

 protected:
  bool Holds(const WorldView& world) override { return world.stage_reached[stage_] != 0; }

 private:
  size_t stage_;
};

// The object's origin is in a box, boundary included. The box is aligned with the axes of the world or of a
// body's frame. The value is the distance (m) by which the origin is outside the box along the axis with the
// largest excess; it is negative inside.
class Inside : public Within {
 public:
  Inside(const Expression& expression, const CompileContext& context)
      : Inside(ArgumentsOf(expression, {"object", "center_m", "half_extents_m"}, {"frame"}), context) {}
  std::vector<std::string> Describe(bool value) const override {
    const auto& [x, y, z] = center_;
    const auto& [dx, dy, dz] = half_extents_;
    return {fmt::format(
        "{} {}inside the box of {:.6g} x {:.6g} x {:.6g} m around ({:.6g}, {:.6g}, {:.6g}) m{}",
        condition_.subject, value ? "" : "not ", 2 * dx, 2 * dy, 2 * dz, x, y, z, frame_.words())};
  }

 protected:
  std::string Words(bool holds, double value) const override {
    return fmt::format("{} {} its box{}, by {:.3g} m", condition_.subject, holds ? "inside" : "outside",
                       frame_.words(), std::abs(value));
  }
  double Value(const WorldView& world) override {
    const std::array<double, 3> position = frame_.Of(world.state.body[body_].position_m, world);
    double out = -std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < 3; ++i) {
      out = std::max(out, std::abs(position[i] - center_[i]) - half_extents_[i]);
    }
    return out;
  }

 private:
  Inside(const YamlMap& arguments, const CompileContext& context) : frame_(arguments, context) {
    body_ = context.names.Body(arguments["object"].Text(), arguments["object"].location());
    center_ = arguments["center_m"].Vector<3>();
    half_extents_ = arguments["half_extents_m"].Vector<3>(kNotNegative);
    upper_ = 0;
    condition_ = About("inside", condition_t::POSE, arguments["object"].Text(), "", "m");
  }
  Frame frame_;
  int body_;
  std::array<double, 3> center_, half_extents_;
};

// The object's tilt (see Tilt) is at most the limit. An upside-down object has a tilt of more than 90
// degrees.
class TiltBelow : public Within {
 public:
  TiltBelow(const Expression& expression, const CompileContext& context) {
    const YamlMap arguments = ArgumentsOf(expression, {"object"}, {"axis", "max_deg", "max_rad"});
    body_ = context.names.Body(arguments["object"].Text(), arguments["object"].location());
    axis_ = TiltAxis(arguments);
    const std::optional<double> max = arguments.Angle("max", {.min = 0, .max = 90});
    if (!max) {
      throw InputError(expression.location().ToString() +
                       ": 'tilt_below' requires either 'max_deg' or 'max_rad'");
    }
    const YamlValue* degrees = arguments.Find("max_deg");
    upper_ = degrees ? degrees->Number() : ToDegrees(*max);
    condition_ = About("tilt_below", condition_t::POSE, arguments["object"].Text(), "", "deg");
    quantity_ = "tilt of " + condition_.subject;
  }

 protected:
  double Value(const WorldView& world) override {
    const double* quat = world.state.body[body_].quat_wxyz;
    const double up_z = quat[0] * quat[0] - quat[1] * quat[1] - quat[2] * quat[2] + quat[3] * quat[3];
    const double tilt = Tilt(quat, axis_);
    return ToDegrees(up_z >= 0 || axis_ == kNoAxis ? tilt : std::numbers::pi - tilt);
  }

 private:
  int body_;
  int axis_;
};

// Every operand is evaluated at every tick, because a latched operand must not miss any.
class Combination : public Predicate {
 public:
  // arguments: keys of the form with `when`, which is required if an expression has arguments.
  Combination(const Expression& expression, const CompileContext& context,
              const std::string& example = "[{touching: {a: pot, b: world}}]",
              const std::vector<const char*>& arguments = {"when"}) {
    if (expression.operands.empty()) {
      throw InputError(expression.location().ToString() + ": '" + expression.name +
                       "' requires predicates, as in " + expression.name + ": " + example);
    }
    const YamlValue& value = expression.arguments;
    const bool has_when = value.is_map() && std::ranges::any_of(value.Entries(), [](const YamlValue& entry) {
                            return entry.key() == "when";
                          });
    // Throws InputError for a key that would otherwise have no effect.
    if (has_when) YamlMap(value, arguments);
    for (const Expression& operand : expression.operands)
      operands_.push_back(CompilePredicate(operand, context));
    was_true_.resize(operands_.size());
  }
  void Start() override {
    for (const auto& operand : operands_) operand->Start();
  }
  void Stand(bool wanted, Standing* standing) const override {
    for (const auto& operand : operands_) operand->Stand(wanted, standing);
  }

 protected:
  // Like Stand(), for a group in which one operand that is `wanted` is enough.
  void StandAsAny(bool wanted, Standing* standing) const {
    const size_t first = standing->written();
    Combination::Stand(wanted, standing);
    if (std::ranges::find(was_true_, uint8_t{wanted}) != was_true_.end()) standing->CompleteGroup(first);
  }
  int CountTrue(const WorldView& world) {
    int count = 0;
    for (size_t k = 0; k < operands_.size(); ++k) {
      was_true_[k] = operands_[k]->Evaluate(world);
      count += was_true_[k];
    }
    return count;
  }
  // Explains why every operand is `value`. If some operands are not, explains the first of these instead.
  void ExplainEach(bool value, std::vector<condition_t>* conditions) const {
    const auto other = std::find(was_true_.begin(), was_true_.end(), !value);
    if (other != was_true_.end()) return operands_[other - was_true_.begin()]->Explain(conditions);
    for (const auto& operand : operands_) operand->Explain(conditions);
  }
  // Writes the conditions below `latched` or `lasts`, which are usually the conditions for the operand to be
  // true. If the standing completes groups, they are the conditions for the operand to be `wanted`, because
  // the conditions of a negated operand are not required. matters: whether the operand's current state can
  // make a difference.
  void StandOfOperand(bool wanted, bool matters, Standing* standing) const {
    const size_t first = standing->written();
    Combination::Stand(wanted || !standing->completes_groups(), standing);
    if (!matters) standing->CompleteGroup(first);
  }
  // Returns the text of the condition that follows them: how the operand is combined. If the standing
  // completes groups, the text contains the operand, because a single condition is taken from the list.
  static std::string TextAfterOperand(const std::vector<std::string>& lines, const Standing& standing) {
    std::string text = lines.front();
    size_t indent = 0;
    for (size_t k = 1; standing.completes_groups() && k < lines.size(); ++k) {
      const size_t begin = lines[k].find_first_not_of(' ');
      text += (begin > indent ? ": " : ", ") + lines[k].substr(begin);
      indent = begin;
    }
    return text;
  }
  // Returns a line that states how the operands are combined, followed by the descriptions of the operands.
  std::vector<std::string> DescribeEach(const std::string& how) const {
    std::vector<std::string> lines = {how};
    for (const auto& operand : operands_) {
      for (const std::string& line : operand->Describe(true)) lines.push_back("  " + line);
    }
    return lines;
  }
  void NeedOne(const Expression& expression) const {
    if (operands_.size() == 1) return;
    throw InputError(expression.location().ToString() + ": '" + expression.name +
                     "' requires exactly one predicate");
  }
  std::vector<std::unique_ptr<Predicate>> operands_;
  // Element i is 1 if operand i was true at the last evaluated tick.
  std::vector<uint8_t> was_true_;
};

class All : public Combination {
 public:
  using Combination::Combination;
  bool Evaluate(const WorldView& world) override {
    return CountTrue(world) == static_cast<int>(operands_.size());
  }
  void Explain(std::vector<condition_t>* conditions) const override { ExplainEach(true, conditions); }
  void Stand(bool wanted, Standing* standing) const override {
    wanted ? Combination::Stand(wanted, standing) : StandAsAny(wanted, standing);
  }
  std::vector<std::string> Describe(bool value) const override {
    return DescribeEach(value ? "all of" : "not all of");
  }
};

class Any : public Combination {
 public:
  using Combination::Combination;
  bool Evaluate(const WorldView& world) override { return CountTrue(world) > 0; }
  void Explain(std::vector<condition_t>* conditions) const override { ExplainEach(false, conditions); }
  void Stand(bool wanted, Standing* standing) const override {
    wanted ? StandAsAny(wanted, standing) : Combination::Stand(wanted, standing);
  }
  std::vector<std::string> Describe(bool value) const override {
    return DescribeEach(value ? "any of" : "none of");
  }
};

class Not : public Combination {
 public:
  Not(const Expression& expression, const CompileContext& context) : Combination(expression, context) {
    NeedOne(expression);
  }
  bool Evaluate(const WorldView& world) override { return CountTrue(world) == 0; }
  void Explain(std::vector<condition_t>* conditions) const override { operands_[0]->Explain(conditions); }
  void Stand(bool wanted, Standing* standing) const override { Combination::Stand(!wanted, standing); }
  std::vector<std::string> Describe(bool value) const override { return operands_[0]->Describe(!value); }
};

// True from the first tick at which its operand is true. The explanation is taken from this tick.
class Latched : public Combination {
 public:
  Latched(const Expression& expression, const CompileContext& context) : Combination(expression, context) {
    NeedOne(expression);
    condition_ = About("latched", condition_t::PROGRESS);
  }
  void Start() override {
    Combination::Start();
    latched_ = false;
    why_.clear();
  }
  bool Evaluate(const WorldView& world) override {
    header_ = world.state.header;
    if (CountTrue(world) > 0 && !latched_) {
      latched_ = true;
      operands_[0]->Explain(&why_);
    }
    return latched_;
  }
  void Explain(std::vector<condition_t>* conditions) const override {
    if (!latched_) return operands_[0]->Explain(conditions);
    conditions->insert(conditions->end(), why_.begin(), why_.end());
  }
  // Writes the operand's current conditions, then whether the operand has ever been true.
  void Stand(bool wanted, Standing* standing) const override {
    StandOfOperand(wanted, wanted && !latched_, standing);
    condition_t& condition =
        standing->Next(condition_, [&] { return TextAfterOperand(Describe(wanted), *standing); });
    condition.holds = latched_ == wanted;
    condition.tick = header_.tick;
    condition.time_s = Seconds(header_.sim_time_us);
  }
  std::vector<std::string> Describe(bool value) const override {
    return DescribeEach(value ? "at any time so far" : "at no time so far");
  }

 private:
  bool latched_ = false;
  std::vector<condition_t> why_;
  header_t header_{};
  condition_t condition_{};
};

// The operand has been true without interruption for at least min_s.
class Lasts : public Combination {
 public:
  Lasts(const Expression& expression, const CompileContext& context)
      : Combination(expression, context, "{min_s: 1, when: {touching: {a: pot, b: world}}}",
                    {"min_s", "when"}) {
    NeedOne(expression);
    const YamlMap arguments(expression.arguments, {"min_s", "when"});
    min_us_ = std::llround(arguments["min_s"].Number({.min = 0, .max = context.task.time_limit}) * 1e6);
    condition_ = About("lasts", condition_t::PROGRESS, "", "", "s");
    condition_.comparison = ">=";
    condition_.threshold_mixed = Seconds(min_us_);
    condition_.has_value = true;
  }
  void Start() override {
    Combination::Start();
    since_us_.reset();
  }
  bool Evaluate(const WorldView& world) override {
    header_ = world.state.header;
    if (CountTrue(world) == 0) {
      since_us_.reset();
    } else if (!since_us_) {
      since_us_ = header_.sim_time_us;
    }
    return Holds();
  }
  void Explain(std::vector<condition_t>* conditions) const override {
    operands_[0]->Explain(conditions);
    if (!since_us_) return;
    condition_t condition = condition_;
    condition.holds = Holds();
    condition.value_mixed = Seconds(header_.sim_time_us - *since_us_);
    condition.text = fmt::format("true for {:.6g} s {} {:.6g} s", condition.value_mixed,
                                 condition.holds ? ">=" : "<", condition.threshold_mixed);
    condition.tick = header_.tick;
    condition.time_s = Seconds(header_.sim_time_us);
    conditions->push_back(std::move(condition));
  }
  // Writes the operand's conditions, then for how long the operand has been true.
  void Stand(bool wanted, Standing* standing) const override {
    StandOfOperand(wanted, wanted, standing);
    condition_t& condition =
        standing->Next(condition_, [&] { return TextAfterOperand(Describe(wanted), *standing); });
    condition.holds = Holds() == wanted;
    condition.comparison = wanted ? ">=" : "<=";
    condition.value_mixed = since_us_ ? Seconds(header_.sim_time_us - *since_us_) : 0;
    condition.tick = header_.tick;
    condition.time_s = Seconds(header_.sim_time_us);
  }
  std::vector<std::string> Describe(bool value) const override {
    return DescribeEach(
        fmt::format("{}for {:.6g} s or longer", value ? "" : "not ", condition_.threshold_mixed));
  }

 private:
  bool Holds() const { return since_us_ && header_.sim_time_us - *since_us_ >= min_us_; }

  int64_t min_us_;
  // Simulated time since which the operand has been true; nothing while it is false.
  std::optional<int64_t> since_us_;
  header_t header_{};
  condition_t condition_{};
};

template <typename T>
std::unique_ptr<Predicate> MakePredicate(const Expression& expression, const CompileContext& context) {
  return std::make_unique<T>(expression, context);
}

std::map<std::string, PredicateMaker>& Predicates() {
  static std::map<std::string, PredicateMaker> makers = {
      {"all", MakePredicate<All>},
      {"any", MakePredicate<Any>},
      {"height_above", MakePredicate<HeightAbove>},
      {"holding", MakePredicate<Holding>},
      {"inside", MakePredicate<Inside>},
      {"lasts", MakePredicate<Lasts>},
      {"latched", MakePredicate<Latched>},
      {"not", MakePredicate<Not>},
      {"on", MakePredicate<On>},
      {"reached", MakePredicate<Reached>},
      {"tilt_below", MakePredicate<TiltBelow>},
      {"touching", MakePredicate<Touching>},
  };
  return makers;
}

}  // namespace

void RegisterPredicate(const std::string& name, const PredicateMaker& make) {
  const std::vector<std::string> taken = PredicateNames();
  if (std::ranges::find(taken, name) != taken.end()) {
    throw InputError("there is already a predicate '" + name + "'");
  }
  Predicates().emplace(name, make);
}

std::vector<std::string> PredicateNames() {
  std::vector<std::string> names = QuantityNames();
  for (const auto& [name, unused] : Predicates()) names.push_back(name);
  std::ranges::sort(names);
  return names;
}

std::unique_ptr<Predicate> CompilePredicate(const Expression& expression, const CompileContext& context) {
  const auto maker = Predicates().find(expression.name);
  if (maker != Predicates().end()) {
    if (auto predicate = maker->second(expression, context)) return predicate;
    throw InputError("predicate '" + expression.name + "': its plugin returned none");
  }
  if (auto within = CompileWithin(expression, context)) return within;
  throw InputError(expression.location().ToString() + ": there is no predicate '" + expression.name + "'" +
                   Suggestion(expression.name, PredicateNames()));
}

}  // namespace evalbus::metrics
