#include "report/latency_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "report/page/assets.h"
#include "report/page/figures.h"

namespace evalbus::report {
namespace {

using results::DelayPoint;
using results::MeasuredMean;

constexpr int kPanelWidth = 360, kPanelHeight = 190, kTop = 66;

RangeFigure FigureOf(const std::vector<DelayPoint>& points, const std::string& name,
                     const std::function<MeasuredMean(const DelayPoint&)>& value) {
  RangeFigure figure{.name = name, .x_unit = "ms", .lines = {}};
  for (const DelayPoint& point : points) {
    const auto line = std::ranges::find(figure.lines, point.execution, &RangeFigure::Line::name);
    RangeFigure::Line& to = line != figure.lines.end()
                                ? *line
                                : figure.lines.emplace_back(RangeFigure::Line{point.execution, {}, {}, {}});
    const MeasuredMean mean = value(point);
    to.x.push_back(point.applied_ms);
    to.value.push_back(mean.mean);
    to.interval.push_back(mean.interval);
  }
  return figure;
}

MeasuredMean InPercent(const MeasuredMean& rate) {
  return {100 * rate.mean, {100 * rate.interval.lower, 100 * rate.interval.upper}};
}

}  // namespace

std::string LatencyFigure(const std::string& title, const std::vector<DelayPoint>& points) {
  const std::vector<RangeFigure> figures = {
      FigureOf(points, "success, %", [](const DelayPoint& p) { return InPercent(p.success); }),
      FigureOf(points, "time to success, s", [](const DelayPoint& p) { return p.completion_time_s; }),
      FigureOf(points, "rms joint jerk, rad/s³", [](const DelayPoint& p) { return p.joint_jerk_radps3; })};
  const int width = kPanelWidth * static_cast<int>(figures.size()) + 20, height = kTop + kPanelHeight + 10;
  Markup svg;
  svg.Open("svg", {{"xmlns", "http://www.w3.org/2000/svg"},
                   {"width", fmt::format("{}", width)},
                   {"height", fmt::format("{}", height)},
                   {"viewBox", fmt::format("0 0 {} {}", width, height)}});
  svg.Element("style", {}, [&] { svg.Verbatim(kReportCss); });
  svg.Empty("rect", {{"width", "100%"}, {"height", "100%"}, {"style", "fill: var(--page)"}});
  svg.Element("text", {{"x", "12"}, {"y", "20"}, {"style", "font-size: 14px; fill: var(--text)"}}, title);
  double x = 12;
  for (size_t i = 0; i < figures[0].lines.size(); ++i) {
    const std::string& name = figures[0].lines[i].name;
    svg.Empty("path", {{"class", "line " + LineColor(name, i)}, {"d", fmt::format("M{} 38h24", x)}});
    svg.Element("text", {{"x", fmt::format("{}", x + 30)}, {"y", "42"}}, name);
    x += 130;
  }
  for (size_t i = 0; i < figures.size(); ++i) {
    svg.Open("svg", {{"x", fmt::format("{}", 10 + kPanelWidth * static_cast<int>(i))},
                     {"y", fmt::format("{}", kTop - 12)},
                     {"width", fmt::format("{}", kPanelWidth)},
                     {"height", fmt::format("{}", kPanelHeight)}});
    DrawRanges(figures[i], &svg);
    svg.Close();
  }
  svg.Close();
  return svg.str();
}

}  // namespace evalbus::report
