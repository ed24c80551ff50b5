#include "metrics/task/predicate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "lcmtypes/clock.h"

namespace evalbus::metrics {
namespace {

void SetTick(const header_t& header, condition_t* condition) {
  condition->tick = header.tick;
  condition->time_s = Seconds(header.sim_time_us);
}

std::string UnitAfterNumber(const std::string& unit) {
  return unit == "1" ? "" : unit == "deg" ? " degrees" : " " + unit;
}

int DecimalsOf(const std::string& text) {
  const size_t point = text.find('.');
  return point == std::string::npos ? 0 : static_cast<int>(text.size() - point - 1);
}

// Number of digits before the decimal point; negative: number of zeros after it.
int DigitsBeforePoint(double value) {
  return value == 0 ? 1 : 1 + static_cast<int>(std::floor(std::log10(std::abs(value))));
}

// Formats a comparison: "27.4 degrees > 20", "1.100 m >= 1.096". Both numbers have at least three digits, at
// least the decimal places of the limit, and enough digits that the printed numbers compare like the exact
// numbers.
std::string Compared(double value, const std::string& relation, double threshold, const std::string& unit) {
  const auto order = [](double a, double b) { return (a > b) - (a < b); };
  std::string text, limit;
  for (int more = 0; more < 15; ++more) {
    limit = fmt::format("{:.{}g}", threshold, std::min(6 + more, 17));
    const int digits = DigitsBeforePoint(value);
    const bool is_plain = more == 0 && digits > -4 && digits < 7;
    text = is_plain
               ? fmt::format("{:.{}f}", value, std::max(DecimalsOf(limit), 3 - digits))
               : fmt::format("{:.{}g}", value, std::clamp(DecimalsOf(limit) + digits, 3, 17 - more) + more);
    if (order(std::stod(text), std::stod(limit)) == order(value, threshold)) break;
  }
  if (value == 0) text = "0";
  return text + UnitAfterNumber(unit) + " " + relation + " " + limit;
}

}  // namespace

bool Relation::Evaluate(const WorldView& world) {
  header_ = world.state.header;
  holds_ = Holds(world);
  return holds_;
}

void Relation::Explain(std::vector<condition_t>* conditions) const {
  condition_t condition = condition_;
  condition.holds = holds_;
  condition.text = holds_ ? text_if_true_ : text_if_false_;
  SetTick(header_, &condition);
  conditions->push_back(std::move(condition));
}

void Relation::Stand(bool wanted, Standing* standing) const {
  condition_t& condition =
      standing->Next(condition_, [&] { return wanted ? text_if_true_ : text_if_false_; });
  condition.holds = holds_ == wanted;
  SetTick(header_, &condition);
}

bool Within::Evaluate(const WorldView& world) {
  header_ = world.state.header;
  value_ = Value(world);
  return Holds();
}

void Within::Stand(bool wanted, Standing* standing) const {
  condition_t& condition = standing->Next(condition_, [&] { return Describe(wanted).front(); });
  condition.holds = Holds() == wanted;
  condition.has_value = true;
  condition.value_mixed = value_;
  condition.threshold_mixed = IsUpperNearer() ? upper_ : lower_;
  condition.comparison = IsUpperNearer() == wanted ? "<=" : ">=";
  SetTick(header_, &condition);
}

std::vector<std::string> Within::Describe(bool value) const {
  const std::string unit = UnitAfterNumber(condition_.unit);
  std::string range;
  if (std::isinf(upper_)) {
    range = fmt::format("at least {:.6g}", lower_);
  } else if (std::isinf(lower_)) {
    range = fmt::format("at most {:.6g}", upper_);
  } else {
    range = fmt::format("between {:.6g} and {:.6g}", lower_, upper_);
  }
  return {quantity_ + (value ? " " : " not ") + range + unit};
}

std::string Within::Words(bool holds, double value) const {
  const bool is_upper = IsUpperNearer();
  const char* relation = holds ? (is_upper ? "<=" : ">=") : (is_upper ? ">" : "<");
  return quantity_ + " " + Compared(value, relation, is_upper ? upper_ : lower_, condition_.unit);
}

void Within::Explain(std::vector<condition_t>* conditions) const {
  const bool is_upper = IsUpperNearer();
  condition_t condition = condition_;
  condition.holds = Holds();
  condition.has_value = true;
  condition.value_mixed = value_;
  condition.threshold_mixed = is_upper ? upper_ : lower_;
  condition.comparison = is_upper ? "<=" : ">=";
  condition.text = Words(condition.holds, condition.value_mixed);
  SetTick(header_, &condition);
  conditions->push_back(std::move(condition));
}

}  // namespace evalbus::metrics
