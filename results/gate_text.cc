#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "metrics/statistics/interval.h"
#include "results/gate.h"

namespace evalbus::results {
namespace {

int MeanDecimals(const GateCriterion& criterion) {
  const double largest = std::max(std::abs(criterion.baseline_mean), std::abs(criterion.mean));
  return criterion.mean_unit == "%" ? 1 : Decimals(largest);
}

// Returns the means of both sides, for example "81.7 -> 90.0 %".
std::string MeansText(const GateCriterion& criterion) {
  return fmt::format("{} -> {}", Fixed(criterion.baseline_mean, MeanDecimals(criterion)),
                     MeanText(criterion, criterion.mean));
}

std::string Bound(double alpha) { return fmt::format("(one-sided {:.3g} % bound)", 100 * (1 - alpha)); }

// Returns, for example, "a loss of at most 2.3 points", or "a gain of at least 1.2 points" if the loss is
// negative.
std::string AtMost(const GateCriterion& criterion, double loss) {
  return loss < 0 ? "a gain of at least " + LossText(criterion, -loss, BoundFrom::kBelow)
                  : "a loss of at most " + LossText(criterion, loss, BoundFrom::kAbove);
}

// Returns, for example, "the loss is between 3.1 points and 17.4 points", or "between a gain of 1.2 points
// and a loss of 17.4 points".
std::string Between(const GateCriterion& criterion) {
  const double lower = criterion.loss_lower, upper = criterion.loss_upper;
  if (lower >= 0) {
    return fmt::format("the loss is between {} and {}", LossText(criterion, lower, BoundFrom::kBelow),
                       LossText(criterion, upper, BoundFrom::kAbove));
  }
  const std::string gain = LossText(criterion, -lower, BoundFrom::kAbove);
  if (upper >= 0) {
    return fmt::format("between a gain of {} and a loss of {}", gain,
                       LossText(criterion, upper, BoundFrom::kAbove));
  }
  return fmt::format("the gain is between {} and {}", LossText(criterion, -upper, BoundFrom::kBelow), gain);
}

std::string Undecided(const GateCriterion& criterion) {
  std::string text;
  if (criterion.pairs == 0) {
    text = "no pair has a value on both sides";
  } else if (std::isfinite(criterion.loss_upper)) {
    text = Between(criterion) +
           (criterion.fail_alpha == metrics::kAlpha ? " (one-sided 95 % bounds)" : " (one-sided bounds)");
  } else if (!std::isfinite(criterion.loss)) {
    text = "the baseline's mean is 0, so the margin cannot be in percent";
  } else {
    text = "too few pairs differ for a bound";
  }
  text += ", margin " + WithUnit(fmt::format("{:.4g}", criterion.margin), criterion.unit);
  if (criterion.more_pairs)
    text += fmt::format("; about {} would decide if these values are the true ones",
                        Plural(*criterion.more_pairs, "more pair"));
  return text;
}

}  // namespace

std::string LossText(const GateCriterion& criterion, double loss, BoundFrom from) {
  constexpr double kRounding = 1e-9;
  constexpr int kMaxDecimals = 6;
  const auto rounded = [&](int decimals) {
    const double scale = std::pow(10, decimals), scaled = loss * scale;
    return (from == BoundFrom::kAbove ? std::ceil(scaled - kRounding) : std::floor(scaled + kRounding)) /
           scale;
  };
  int decimals = criterion.margin >= 1 ? 1 : 3;
  while (loss != 0 && decimals < kMaxDecimals && std::abs(loss) < std::pow(10, -decimals)) ++decimals;
  // A bound that differs from the margin is not shown as the margin.
  const auto is_margin = [&](double value) { return std::abs(value - criterion.margin) < kRounding; };
  while (!is_margin(loss) && decimals < kMaxDecimals && is_margin(rounded(decimals))) ++decimals;
  return WithUnit(Fixed(rounded(decimals), decimals), criterion.unit);
}

std::string MeanText(const GateCriterion& criterion, double mean) {
  return WithUnit(Fixed(mean, MeanDecimals(criterion)), criterion.mean_unit);
}

std::string WhyText(const GateCriterion& criterion) {
  const std::string values =
      criterion.pairs == 0 ? criterion.what
                           : fmt::format("{} {} in {}{}", criterion.what, MeansText(criterion),
                                         Plural(criterion.pairs, "pair"),
                                         criterion.pairs_are_successes ? " in which both succeeded" : "");
  const std::string margin = ", margin " + WithUnit(fmt::format("{:.4g}", criterion.margin), criterion.unit);
  switch (criterion.verdict) {
    case GateVerdict::kPass:
      return fmt::format("{}: {} {}{}", values, AtMost(criterion, criterion.loss_upper),
                         Bound(metrics::kAlpha), margin);
    case GateVerdict::kFail:
      return fmt::format("{}: a loss of at least {} {}{}", values,
                         LossText(criterion, criterion.loss_lower, BoundFrom::kBelow),
                         Bound(criterion.fail_alpha), margin);
    case GateVerdict::kCannotTell:
      break;
  }
  return values + ": " + Undecided(criterion);
}

std::string GateText(const Gate& gate) {
  std::string text =
      fmt::format("{}  {} against {}: {}\n", Word(gate.verdict), gate.run, gate.baseline, gate.why);
  if (gate.criteria.size() > 1) {
    text += "\n";
    for (const GateCriterion& criterion : gate.criteria)
      text += fmt::format("{:<12}  {}\n", Word(criterion.verdict), criterion.why);
  }
  for (const std::string& remark : gate.remarks) text += "\nnote: " + remark;
  return gate.remarks.empty() ? text : text + "\n";
}

}  // namespace evalbus::results
