#include "report/page/ratio_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/page/scale.h"

namespace evalbus::report {
namespace {

constexpr double kTicks[] = {0.1, 0.2, 0.5, 1, 2, 5, 10};
constexpr double kSlack = 1e-9;

std::string Px(double share) { return fmt::format("{:.2f}%", 100 * share); }

}  // namespace

void RatioAxis::Include(double ratio, const metrics::Interval& interval) {
  for (const double value : {ratio, interval.lower, interval.upper}) {
    if (!std::isfinite(value)) continue;
    const double* const above =
        std::ranges::find_if(kTicks, [&](double tick) { return tick >= value - kSlack; });
    most_ = std::max(most_, above == std::end(kTicks) ? std::end(kTicks)[-1] : *above);
    const double* below = above;
    while (below != std::begin(kTicks) && (below == std::end(kTicks) || *below > value + kSlack)) --below;
    least_ = std::min(least_, *below);
  }
}

std::vector<double> RatioAxis::ticks() const {
  std::vector<double> ticks;
  for (const double tick : kTicks) {
    if (tick >= least_ - kSlack && tick <= most_ + kSlack) ticks.push_back(tick);
  }
  return ticks;
}

double RatioAxis::At(double ratio) const {
  // Leaves a margin of 4 % on each side.
  const double share = std::log(std::clamp(ratio, least_, most_) / least_) / std::log(most_ / least_);
  return 0.04 + 0.92 * share;
}

void RatioAxis::DrawTicks(Markup* html) const {
  for (const double tick : ticks()) {
    html->Empty("line", {{"class", tick == 1 ? "axis" : "grid"},
                         {"x1", Px(At(tick))},
                         {"x2", Px(At(tick))},
                         {"y1", "0"},
                         {"y2", "18"}});
  }
}

void RatioAxis::DrawLabels(Markup* html) const {
  html->Element("svg", {{"class", "share"}, {"aria-hidden", "true"}}, [&] {
    const std::vector<double> all = ticks();
    for (const double tick : all) {
      // On phones, all labels would touch, so only the labels of 1 and of both ends are shown.
      const bool is_major = tick == 1 || tick == all.front() || tick == all.back();
      html->Element(
          "text",
          {{"class", is_major ? "" : "minor"}, {"x", Px(At(tick))}, {"y", "13"}, {"text-anchor", "middle"}},
          tick == 1 ? std::string("1") : "×" + Number(tick, 3));
    }
  });
}

void RatioAxis::Draw(double ratio, const metrics::Interval& interval, const std::string& css_class,
                     Markup* html) const {
  html->Element("svg", {{"class", "share"}, {"aria-hidden", "true"}}, [&] {
    DrawTicks(html);
    const std::string effect = "effect " + css_class;
    if (ratio > most_ + kSlack || ratio < least_ - kSlack) {
      html->Element("text", {{"class", effect}, {"x", Px(At(ratio))}, {"y", "13"}, {"text-anchor", "middle"}},
                    ratio > most_ ? "▶" : "◀");
      return;
    }
    if (std::isfinite(interval.lower)) {
      html->Empty("line", {{"class", effect},
                           {"x1", Px(At(interval.lower))},
                           {"x2", Px(At(interval.upper))},
                           {"y1", "9"},
                           {"y2", "9"}});
    }
    html->Empty("circle", {{"class", effect}, {"cx", Px(At(ratio))}, {"cy", "9"}, {"r", "4"}});
  });
}

std::string RatioText(double ratio, const metrics::Interval& interval) {
  const int three_digits = ratio < 9.995 ? 2 : ratio < 99.95 ? 1 : 0;
  return "×" + Fixed(ratio, std::min(three_digits, Decimals(ratio, metrics::StandardErrorOf(interval))));
}

}  // namespace evalbus::report
