#include "metrics/task/expressions.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <sstream>

#include "base/errors.h"

namespace evalbus::metrics {

Arguments::Arguments(const Expression& expression, std::vector<std::string> required,
                     std::vector<std::string> optional)
    : expression_(expression) {
  const std::string name = "'" + expression.name + "'";
  if (!expression.operands.empty()) {
    throw InputError(expression.location.ToString() + ": " + name +
                     " takes arguments, not other expressions");
  }
  std::string known;
  for (const auto* keys : {&required, &optional}) {
    for (const std::string& key : *keys) known += (known.empty() ? "" : ", ") + key;
  }
  for (auto argument = expression.arguments.begin(); argument != expression.arguments.end(); ++argument) {
    const auto is_key = [&](const std::string& key) { return key == argument->key; };
    if (std::none_of(required.begin(), required.end(), is_key) &&
        std::none_of(optional.begin(), optional.end(), is_key)) {
      throw InputError(argument->location.ToString() + ": " + name + " has no argument '" + argument->key +
                       "'; expected " + known);
    }
    if (std::any_of(expression.arguments.begin(), argument,
                    [&](const auto& a) { return a.key == argument->key; })) {
      throw InputError(argument->location.ToString() + ": " + name + " has '" + argument->key + "' twice");
    }
  }
  for (const std::string& key : required) {
    if (!Find(key)) {
      throw InputError(expression.location.ToString() + ": " + name + " needs the argument '" + key + "'");
    }
  }
}

const Expression::Argument* Arguments::Find(const std::string& key) const {
  for (const Expression::Argument& argument : expression_.arguments) {
    if (argument.key == key) return &argument;
  }
  return nullptr;
}

const Expression::Argument& Arguments::operator[](const std::string& key) const { return *Find(key); }

double Arguments::Number(const std::string& key) const {
  const Expression::Argument& argument = (*this)[key];
  char* end = nullptr;
  const double number = std::strtod(argument.value.c_str(), &end);
  if (argument.value.empty() || *end != '\0' || !std::isfinite(number)) {
    throw InputError(argument.location.ToString() + ": key '" + key + "': expected a number, got '" +
                     argument.value + "'");
  }
  return number;
}

std::array<double, 3> Arguments::Vector(const std::string& key) const {
  const Expression::Argument& argument = (*this)[key];
  std::istringstream stream(argument.value);
  std::array<double, 3> vector{};
  for (double& number : vector) stream >> number;
  if (!stream || stream.peek() != std::istringstream::traits_type::eof()) {
    throw InputError(argument.location.ToString() + ": key '" + key +
                     "': expected a list of 3 numbers, got '" + argument.value + "'");
  }
  return vector;
}

std::array<double, 2> Arguments::Limits(const std::string& min, const std::string& max) const {
  if (!Find(min) && !Find(max)) {
    throw InputError(expression_.location.ToString() + ": '" + expression_.name + "' needs '" + min + "', '" +
                     max + "' or both");
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {Find(min) ? Number(min) : -kInfinity, Find(max) ? Number(max) : kInfinity};
}

double Arguments::Angle(const std::string& stem) const {
  const bool has_degrees = Find(stem + "_deg") != nullptr;
  if (has_degrees == (Find(stem + "_rad") != nullptr)) {
    throw InputError(expression_.location.ToString() + ": '" + expression_.name + "' needs either '" + stem +
                     "_deg' or '" + stem + "_rad'");
  }
  return has_degrees ? Number(stem + "_deg") * std::numbers::pi / 180 : Number(stem + "_rad");
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

JointFraction::JointFraction(const Arguments& arguments, const CompileContext& context) {
  const Expression::Argument& name = arguments["joint"];
  const model_info_t& model = context.names.model();
  const int joint = context.names.Joint(name.value, name.location);
  coordinate_ = model.joint_qpos_index[joint];
  lower_ = model.joint_lower_mixed[joint];
  range_ = model.joint_upper_mixed[joint] - lower_;
  if (!(range_ > 0)) {
    throw InputError(name.location.ToString() + ": joint '" + name.value +
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

int TiltAxis(const Arguments& arguments) {
  const Expression::Argument* axis = arguments.Find("axis");
  if (!axis) return kNoAxis;
  if (axis->value == "x") return 0;
  if (axis->value == "y") return 1;
  throw InputError(axis->location.ToString() + ": key 'axis': expected x or y, got '" + axis->value + "'");
}

}  // namespace evalbus::metrics
