#include "metrics/task/expressions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"

namespace evalbus::metrics {

YamlMap ArgumentsOf(const Expression& expression, std::initializer_list<const char*> required,
                    std::initializer_list<const char*> optional) {
  if (!expression.operands.empty()) {
    throw InputError(expression.location().ToString() + ": '" + expression.name +
                     "' takes arguments, not other expressions");
  }
  return YamlMap(expression.arguments, required, optional);
}

std::array<double, 2> Limits(const YamlMap& arguments, const std::string& min, const std::string& max) {
  const YamlValue* lower = arguments.Find(min);
  const YamlValue* upper = arguments.Find(max);
  if (!lower && !upper) {
    throw InputError(arguments.value().location().ToString() + ": '" + arguments.value().key() + "' needs '" +
                     min + "', '" + max + "' or both");
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {lower ? lower->Number() : -kInfinity, upper ? upper->Number() : kInfinity};
}

bool Touch(std::span<const contact_t> contacts, const std::vector<uint8_t>& a,
           const std::vector<uint8_t>& b) {
  const auto in = [](const std::vector<uint8_t>& set, int geom) {
    return geom >= 0 && static_cast<size_t>(geom) < set.size() && set[geom];
  };
  return std::any_of(contacts.begin(), contacts.end(), [&](const contact_t& contact) {
    return contact.distance_m <= contact_t::TOUCH_DISTANCE_M &&
           ((in(a, contact.geom_a) && in(b, contact.geom_b)) ||
            (in(b, contact.geom_a) && in(a, contact.geom_b)));
  });
}

JointFraction::JointFraction(const YamlMap& arguments, const CompileContext& context) {
  const YamlValue& name = arguments["joint"];
  const model_info_t& model = context.names.model();
  const int joint = context.names.Joint(name.Text(), name.location());
  coordinate_ = model.joint_qpos_index[joint];
  lower_ = model.joint_lower_mixed[joint];
  range_ = model.joint_upper_mixed[joint] - lower_;
  if (!(range_ > 0)) {
    throw InputError(name.location().ToString() + ": joint '" + name.Text() +
                     "' has no range to be a fraction of");
  }
}

double Tilt(const std::vector<double>& quat_wxyz, int axis) {
  // The body's z axis in the world, of any norm.
  const double w = quat_wxyz[0], x = quat_wxyz[1], y = quat_wxyz[2], z = quat_wxyz[3];
  const std::array<double, 3> up = {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z};
  // atan2 of the parts along and across the axis is exact where the arc cosine is not.
  const int along = axis == kNoAxis ? 2 : axis;
  const double across = std::hypot(up[(along + 1) % 3], up[(along + 2) % 3]);
  return axis == kNoAxis ? std::atan2(across, up[along]) : std::atan2(std::abs(up[along]), across);
}

int TiltAxis(const YamlMap& arguments) {
  const YamlValue* axis = arguments.Find("axis");
  if (!axis) return kNoAxis;
  const std::string name = axis->Text();
  if (name == "x") return 0;
  if (name == "y") return 1;
  axis->Fail("expected x or y, got '" + name + "'");
}

}  // namespace evalbus::metrics
