#include "runner/environment_contract.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "base/errors.h"
#include "lcmtypes/clock.h"

namespace evalbus::runner {
namespace {

using policy::ActionKind;

constexpr double kJointSpeed = 2;        // rad/s
constexpr double kEefSpeed = 0.5;        // m/s
constexpr double kFarthestPosition = 2;  // m

// A kind of control, with the keys that describe its action in a contract.
struct Control {
  const char* name;
  const char* keys;
  bool is_eef;
};
constexpr char kEefKeys[] = ", frame: world, point: flange, rotation: euler_xyz_extrinsic";
constexpr Control kControls[] = {
    {"joint", "kind: joint_position", false},
    {"joint_delta", "kind: joint_delta, delta_on: target", false},
    {"eef_pose", "kind: eef_pose", true},
    {"eef_delta", "kind: eef_delta, delta_on: target", true},
};
// Three position coordinates and three Euler angles.
constexpr int kPoseValues = 6;

const Control& FindControl(const std::string& name) {
  for (const Control& control : kControls) {
    if (control.name == name) return control;
  }
  throw InputError(fmt::format("--control {}: expected one of {}", name, ControlNames()));
}

// Returns the range of the value at `place` in the indices of an arm.
std::pair<double, double> RangeOf(const policy::ActionSpace& space, const arm_info_t& arm, size_t place,
                                  double step_s) {
  const double linear = kEefSpeed * step_s, angular = kJointSpeed * step_s;
  switch (space.kind) {
    case ActionKind::kJointPosition:
      return {arm.joint_lower_rad.at(place), arm.joint_upper_rad.at(place)};
    case ActionKind::kJointDelta:
      return {-angular, angular};
    case ActionKind::kJointVelocity:
      return {-kJointSpeed, kJointSpeed};
    case ActionKind::kEefPose: {
      const double limit = place < 3 ? kFarthestPosition : std::numbers::pi;
      return {-limit, limit};
    }
    case ActionKind::kEefDelta: {
      const double limit = place < 3 ? linear : angular;
      return {-limit, limit};
    }
  }
  return {};
}

}  // namespace

std::string ControlNames() {
  std::vector<std::string> names;
  for (const Control& control : kControls) names.emplace_back(control.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

policy::Contract MakeContract(const ContractForm& form, double rate_hz, const model_info_t& model) {
  const Control& control = FindControl(form.control);
  std::vector<std::string> joints, openings, arms;
  int next = 0;
  for (const arm_info_t& arm : model.arm) {
    joints.push_back(arm.name + ".joint_position_rad");
    next += control.is_eef ? kPoseValues : arm.num_joints;
  }
  const int first_gripper = next;
  int first = 0;
  for (size_t i = 0; i < model.arm.size(); ++i) {
    const int size = control.is_eef ? kPoseValues : model.arm[i].num_joints;
    std::string line =
        fmt::format("    - {{arm: {}, indices: {}-{}", model.arm[i].name, first, first + size - 1);
    first += size;
    const bool has_gripper = std::ranges::any_of(
        model.gripper, [&](const gripper_info_t& g) { return g.arm == static_cast<int>(i); });
    if (has_gripper) {
      openings.push_back(model.arm[i].name + ".gripper_opening");
      line += fmt::format(", gripper: {{index: {}, open: 0, closed: 1}}", next++);
    }
    arms.push_back(line + "}\n");
  }
  std::string text = fmt::format(
      "description: joint positions{}; actions of kind {}\n"
      "wire: openpi\nurl: ws://127.0.0.1:8000\nrate_hz: {}\nobservation:\n"
      "  - key: state\n    state: [{}{}{}]\n",
      form.cameras.empty() ? "" : " and images", control.name, rate_hz, fmt::join(joints, ", "),
      openings.empty() ? "" : ", ", fmt::join(openings, ", "));
  for (const std::string& camera : form.cameras) {
    text += fmt::format("  - {{key: [images, {0}], camera: {0}, size_px: [{1}, {2}]}}\n", camera,
                        form.width_px, form.height_px);
  }
  text += fmt::format("action:\n  values: {}\n  execute_steps: 1\n", first_gripper + openings.size());
  std::string keys = std::string(control.keys) + (control.is_eef ? kEefKeys : "");
  for (size_t at; (at = keys.find(", ")) != std::string::npos;) keys.replace(at, 2, "\n  ");
  text += "  " + keys + "\n  arms:\n";
  for (const std::string& arm : arms) text += arm;
  return policy::ParseContract(text, "contract of the environment");
}

ActionBounds BoundsOf(const policy::ActionSpace& space, const model_info_t& model) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto size = static_cast<size_t>(space.num_values);
  ActionBounds bounds{std::vector<double>(size, -kInfinity), std::vector<double>(size, kInfinity)};
  if (!space.scale.empty() || !space.offset.empty()) return bounds;
  const double step_s = ControlPeriod(model);
  for (const policy::ArmForm& form : space.arms) {
    const auto arm = std::ranges::find(model.arm, form.arm, &arm_info_t::name);
    if (arm == model.arm.end()) continue;
    // Poses whose rotations do not have three values are left unlimited, because the range of angles does not
    // apply to them.
    const bool is_usual = NumValues(space.rotation) == 3 || space.kind < ActionKind::kEefPose;
    for (size_t place = 0; place < form.indices.size() && is_usual; ++place) {
      const auto index = static_cast<size_t>(form.indices[place]);
      std::tie(bounds.lower[index], bounds.upper[index]) = RangeOf(space, *arm, place, step_s);
    }
    if (form.gripper.index) {
      const auto index = static_cast<size_t>(*form.gripper.index);
      std::tie(bounds.lower[index], bounds.upper[index]) =
          std::minmax({form.gripper.open, form.gripper.closed});
    }
  }
  return bounds;
}

}  // namespace evalbus::runner
