#include "metrics/task/expressions.h"

#include <algorithm>
#include <cmath>

#include "base/errors.h"

namespace evalbus::metrics {

YamlMap ArgumentsOf(const Expression& expression, const std::vector<const char*>& required,
                    const std::vector<const char*>& optional) {
  if (!expression.operands.empty()) {
    throw InputError(expression.location().ToString() + ": '" + expression.name +
                     "' takes arguments, not other expressions");
  }
  return YamlMap(expression.arguments, required, optional);
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

Frame::Frame(const YamlMap& arguments, const CompileContext& context) {
  const YamlValue* frame = arguments.Find("frame");
  if (!frame) return;
  body_ = context.names.Body(frame->Text(), frame->location());
  words_ = " in the frame of " + frame->Text();
}

std::array<double, 3> Frame::Of(const double* position, const WorldView& world) const {
  if (body_ < 0) return {position[0], position[1], position[2]};
  const double *origin = world.state.body[body_].position_m, *quat = world.state.body[body_].quat_wxyz;
  const std::array<double, 3> v = {position[0] - origin[0], position[1] - origin[1], position[2] - origin[2]};
  const double inverse[4] = {-quat[0], quat[1], quat[2], quat[3]};
  return Rotated(v, inverse);
}

std::array<double, 3> Rotated(const std::array<double, 3>& v, const double* quat_wxyz) {
  // v + 2 u x (u x v + w v), where u is the vector part of the quaternion.
  const double w = quat_wxyz[0], x = quat_wxyz[1], y = quat_wxyz[2], z = quat_wxyz[3];
  const std::array<double, 3> t = {y * v[2] - z * v[1] + w * v[0], z * v[0] - x * v[2] + w * v[1],
                                   x * v[1] - y * v[0] + w * v[2]};
  return {v[0] + 2 * (y * t[2] - z * t[1]), v[1] + 2 * (z * t[0] - x * t[2]),
          v[2] + 2 * (x * t[1] - y * t[0])};
}

double Tilt(const double* quat_wxyz, int axis) {
  // The body's z axis in the world frame, not normalized.
  const double w = quat_wxyz[0], x = quat_wxyz[1], y = quat_wxyz[2], z = quat_wxyz[3];
  const std::array<double, 3> up = {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z};
  // atan2 of the components along and across the axis is accurate near 0 and pi, where the arc cosine is not.
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
