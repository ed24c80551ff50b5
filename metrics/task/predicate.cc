#include "metrics/task/predicate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lcmtypes/clock.h"

namespace evalbus::metrics {
namespace {

void SetTick(const header_t& header, condition_t* condition) {
  condition->tick = header.tick;
  condition->time_s = Seconds(header.sim_time_us);
}

std::string UnitAfterNumber(const std::string& unit) {
  return unit == "1" || unit.empty() ? "" : unit == "deg" ? " degrees" : " " + unit;
}

int DecimalsOf(const std::string& text) {
  const size_t point = text.find('.');
  return point == std::string::npos ? 0 : static_cast<int>(text.size() - point - 1);
}

// Returns the number of digits before the decimal point; negative: number of zeros after it.
int DigitsBeforePoint(double value) {
  return value == 0 || !std::isfinite(value) ? 1
                                             : 1 + static_cast<int>(std::floor(std::log10(std::abs(value))));
}

// Decimals of a value: millimeters of a length, tenths of an angle in degrees (hundredths below 1);
// otherwise, at least three digits and at least as many decimals as the limit has.
int DecimalsOf(double value, const std::string& unit, const std::string& limit) {
  if (unit == "m") return 3;
  if (unit == "deg") return std::abs(value) < 1 ? 2 : 1;
  return std::max(DecimalsOf(limit), 3 - DigitsBeforePoint(value));
}

bool IsTrue(double value, const std::string& relation, double limit) {
  if (value == limit) return relation.ends_with('=');
  return (value > limit) == relation.starts_with('>');
}

}  // namespace

ComparisonText Compared(double value, const std::string& relation, double threshold,
                        const std::string& unit) {
  // Next to a limit of 0.1, a value of 3.08e-07 is shown as 0.
  if (std::abs(value) < std::min(1e-4, 1e-3 * std::abs(threshold)) && IsTrue(0, relation, threshold))
    value = 0;
  std::string text, limit;
  for (int more = 0; more < 15; ++more) {
    limit = fmt::format("{:.{}g}", threshold, std::min(6 + more, 17));
    const int digits = DigitsBeforePoint(value);
    const bool is_plain = more == 0 && digits < 7 && (digits > -4 || unit == "m" || unit == "deg");
    text = is_plain
               ? Fixed(value, DecimalsOf(value, unit, limit))
               : fmt::format("{:.{}g}", value, std::clamp(DecimalsOf(limit) + digits, 3, 17 - more) + more);
    if (IsTrue(std::stod(text), relation, std::stod(limit))) break;
  }
  if (value == 0) text = "0";
  return {text + UnitAfterNumber(unit), limit};
}

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
  const auto [text, limit] = Compared(value, relation, is_upper ? upper_ : lower_, condition_.unit);
  return quantity_ + " " + text + " " + relation + " " + limit;
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
