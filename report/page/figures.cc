#include "report/page/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/linestring.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "report/page/page.h"
#include "report/page/scale.h"

namespace evalbus::report {
namespace {

using Kind = EpisodeEvent::Kind;

// Formats pixels with one decimal, without a trailing ".0".
std::string Px(double pixels) {
  const double rounded = std::round(pixels * 10) / 10;
  return fmt::format("{}", rounded == 0 ? 0 : rounded);
}

std::string CssPercent(double share) { return fmt::format("{:.2f}%", std::clamp(share, 0.0, 1.0) * 100); }

// Formats the label of an axis tick, with as many decimals as the tick step.
std::string TickLabel(double value, double step) {
  if (std::abs(value) >= 1e6 || step < 1e-4) return Number(value);
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  return fmt::format("{:.{}f}", value == 0 ? 0 : value, decimals);
}

void Line(const std::string& css_class, double x1, double y1, double x2, double y2, Markup* html) {
  html->Empty("line", {{"class", css_class}, {"x1", Px(x1)}, {"y1", Px(y1)}, {"x2", Px(x2)}, {"y2", Px(y2)}});
}

void Label(double x, double y, const std::string& anchor, const std::string& text, Markup* html) {
  html->Element("text", {{"x", Px(x)}, {"y", Px(y)}, {"text-anchor", anchor}}, text);
}

// Returns half the width of a string in pixels, estimated from its number of characters.
double HalfWidth(const std::string& text) {
  return 3.2 * static_cast<double>(
                   std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

// Draws the axis below a figure; the outermost labels are kept inside the figure.
void DrawScale(const Axis& axis, const Ticks& ticks, double y, const std::string& unit, Markup* html) {
  constexpr double kOverhang = 8;
  double previous_right = -kOverhang;
  Line("axis", axis.pixel_from, y, axis.pixel_to, y, html);
  for (size_t i = 0; i < ticks.at.size(); ++i) {
    const double x = axis(ticks.at[i]);
    Line("axis", x, y, x, y + 3, html);
    const bool last = i + 1 == ticks.at.size();
    std::string text = TickLabel(ticks.at[i], ticks.step);
    const auto right_of = [&](const std::string& label) {
      return std::min(x + HalfWidth(label), axis.pixel_to + kOverhang);
    };
    const auto left_of = [&](const std::string& label) { return right_of(label) - 2 * HalfWidth(label); };
    // The unit is added only if it fits, because the title also contains it.
    const std::string with_unit = text + " " + unit;
    if (last && !unit.empty() && left_of(with_unit) > previous_right + 4) text = with_unit;
    const double left = left_of(text), right = right_of(text);
    if (left <= previous_right + 2) continue;
    Label((left + right) / 2, y + 15, "middle", text, html);
    previous_right = right;
  }
}

void OpenFigure(double width, double height, const std::string& label, Markup* html) {
  html->Open("svg", {{"class", "figure"},
                     {"viewBox", fmt::format("0 0 {} {}", width, height)},
                     {"role", "img"},
                     {"aria-label", label}});
}

// Draws the horizontal grid lines of a figure, with their values.
void DrawGrid(const Ticks& ticks, const Axis& y, double left, double right, Markup* html) {
  for (const double value : ticks.at) {
    Line("grid", left, y(value), right, y(value), html);
    Label(left - 5, y(value) + 4, "end", TickLabel(value, ticks.step), html);
  }
}

// Draws a share as a bar on a background that spans 0 to 100 %.
void DrawBarOnTrack(double share, const std::string& css_class, Markup* html) {
  html->Empty("rect", {{"class", "track"}, {"x", "0"}, {"y", "2"}, {"width", "100%"}, {"height", "14"}});
  html->Empty("rect",
              {{"class", css_class}, {"x", "0"}, {"y", "2"}, {"width", CssPercent(share)}, {"height", "14"}});
}

const char* ClassOf(Kind kind) {
  switch (kind) {
    case Kind::kStage:
      return "event stage";
    case Kind::kSlip:
      return "event slip";
    case Kind::kCollision:
      return "event collision";
    case Kind::kEnd:
      break;
  }
  return "event end";
}

// Returns the SVG path of an event mark: a triangle, diamond, cross or square, 6 to 9 pixels wide. The marks
// differ in shape as well as in color.
std::string MarkPath(Kind kind, double x, double y) {
  const auto at = [&](double dx, double dy) { return Px(x + dx) + " " + Px(y + dy); };
  switch (kind) {
    case Kind::kStage:
      return "M" + at(-4, 3.5) + "L" + at(0, -4) + "L" + at(4, 3.5) + "Z";
    case Kind::kSlip:
      return "M" + at(-4, 0) + "L" + at(0, -4.5) + "L" + at(4, 0) + "L" + at(0, 4.5) + "Z";
    case Kind::kCollision:
      return "M" + at(-3.5, -3.5) + "L" + at(3.5, 3.5) + "M" + at(-3.5, 3.5) + "L" + at(3.5, -3.5);
    case Kind::kEnd:
      break;
  }
  return "M" + at(-3, -3) + "H" + Px(x + 3) + "V" + Px(y + 3) + "H" + Px(x - 3) + "Z";
}

}  // namespace

std::string PathOf(std::span<const double> x, std::span<const double> y, const Axis& x_axis,
                   const Axis& y_axis) {
  namespace bg = boost::geometry;
  using Points = bg::model::linestring<bg::model::d2::point_xy<double>>;
  constexpr double kTolerance = 0.25;  // pixels
  std::string path;
  Points points, kept;
  const auto draw = [&] {
    if (points.empty()) return;
    kept.clear();
    bg::simplify(points, kept, kTolerance);
    for (size_t i = 0; i < kept.size(); ++i) {
      path += (i == 0 ? "M" : "L") + Px(kept[i].x()) + " " + Px(kept[i].y());
    }
    points.clear();
  };
  for (size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(y[i])) {
      points.emplace_back(x_axis(x[i]), y_axis(y[i]));
    } else {
      draw();
    }
  }
  draw();
  return path;
}

void DrawHistogram(const HistogramFigure& figure, Markup* html) {
  constexpr double kWidth = 260, kHeight = 116, kLeft = 26, kRight = 250, kTop = 22, kBottom = 94;
  std::vector<double> all = figure.succeeded;
  all.insert(all.end(), figure.failed.begin(), figure.failed.end());
  const std::vector<double> edges = BinEdges(all);
  const std::vector<int> good = CountInBins(figure.succeeded, edges);
  const std::vector<int> bad = CountInBins(figure.failed, edges);
  int highest = 1;
  for (size_t k = 0; k < good.size(); ++k) highest = std::max(highest, good[k] + bad[k]);

  const Axis x{edges.front(), edges.back(), kLeft, kRight};
  const Axis y{0, static_cast<double>(highest), kBottom, kTop};
  const std::string what = WithUnit("median " + Number(figure.median), figure.unit) +
                           ", 5th to 95th percentile " +
                           WithUnit(Number(figure.p5) + " to " + Number(figure.p95), figure.unit);
  OpenFigure(kWidth, kHeight, "histogram of " + figure.name + ": " + what, html);
  Line("grid", kLeft, kTop, kRight, kTop, html);
  Label(kLeft - 5, kTop + 4, "end", std::to_string(highest), html);
  Label(kLeft - 5, kBottom + 1, "end", "0", html);

  const bool integers = edges.front() != std::floor(edges.front()) && edges[1] - edges[0] == 1;
  for (size_t k = 0; k < good.size(); ++k) {
    if (good[k] + bad[k] == 0) continue;
    const double left = x(edges[k]) + 0.5, right = x(edges[k + 1]) - 0.5;
    const std::string range =
        integers ? Number(edges[k] + 0.5) : Number(edges[k]) + " to " + Number(edges[k + 1]);
    html->Element("g", {}, [&] {
      html->Element("title", {},
                    fmt::format("{}: {} of {} episodes{}", WithUnit(range, figure.unit), good[k] + bad[k],
                                all.size(), bad[k] > 0 ? fmt::format(", {} without success", bad[k]) : ""));
      const auto bar = [&](const char* css_class, int from, int to) {
        if (from == to) return;
        html->Empty("rect", {{"class", css_class},
                             {"x", Px(left)},
                             {"y", Px(y(to))},
                             {"width", Px(right - left)},
                             {"height", Px(y(from) - y(to))}});
      };
      bar("good", 0, good[k]);
      bar("bad", good[k], good[k] + bad[k]);
    });
  }

  html->Element("g", {{"class", "quantiles"}}, [&] {
    html->Element("title", {}, what);
    Line("range", x(figure.p5), kTop - 10, x(figure.p95), kTop - 10, html);
    Line("range", x(figure.p5), kTop - 13, x(figure.p5), kTop - 7, html);
    Line("range", x(figure.p95), kTop - 13, x(figure.p95), kTop - 7, html);
    html->Empty("circle",
                {{"class", "median"}, {"cx", Px(x(figure.median))}, {"cy", Px(kTop - 10)}, {"r", "3.5"}});
  });
  DrawScale(x, TicksWithin(edges.front(), edges.back(), 5), kBottom, figure.unit, html);
  html->Close();
}

void DrawEventMark(Kind kind, Markup* html) {
  html->Element("svg", {{"class", "mark"}, {"viewBox", "0 0 12 12"}, {"aria-hidden", "true"}}, [&] {
    html->Empty("path", {{"class", ClassOf(kind)}, {"d", MarkPath(kind, 6, 6)}});
  });
}

std::string LineColor(const std::string& name, size_t index) {
  if (name.empty()) return "";
  std::string words = " " + name + " ";
  std::ranges::replace(words, '_', ' ');
  for (const char* arm : {"left", "right"}) {
    if (words.find(fmt::format(" {} ", arm)) != std::string::npos) return arm;
  }
  return fmt::format("o{}", index % 4);
}

void DrawCurves(const CurveFigure& figure, Markup* html) {
  constexpr double kWidth = 360, kHeight = 168, kLeft = 44, kRight = 350, kTop = 18, kBottom = 144;
  // A log may have no STATE that fits its MODEL.
  if (figure.time.empty()) return;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const CurveFigure::Line& line : figure.lines) {
    for (const double value : line.value) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  // Extends the axis to zero if zero is near, cuts off values slightly below zero, and adds a margin around
  // constant lines.
  if (low > 0 && low < 0.5 * high) low = 0;
  if (low < 0 && low > -0.02 * high) low = 0;
  if (!IsRange(low, high)) {
    const double room = low == 0 ? 1 : std::abs(low) * 0.5;
    low = low == 0 ? 0 : low - room;
    high += room;
  }
  const Ticks values = TicksAround(low, high, 5);
  double end = figure.time.back();
  for (const EpisodeEvent& event : figure.events) end = std::max(end, event.time);
  if (end <= 0) end = 1;
  const Axis x{0, end, kLeft, kRight};
  const Axis y{values.at.front(), values.at.back(), kBottom, kTop};

  OpenFigure(kWidth, kHeight, figure.name + " over episode time", html);
  DrawGrid(values, y, kLeft, kRight, html);
  DrawScale(x, TicksWithin(0, end, 6), kBottom, "s", html);
  for (const EpisodeEvent& event : figure.events) {
    if (event.kind == Kind::kEnd) continue;
    html->Element("g", {}, [&] {
      html->Element("title", {}, fmt::format("{:.2f} s: {}", event.time, event.text));
      Line(ClassOf(event.kind), x(event.time), kTop - 6, x(event.time), kBottom, html);
      html->Empty("path",
                  {{"class", ClassOf(event.kind)}, {"d", MarkPath(event.kind, x(event.time), kTop - 10)}});
    });
  }
  for (size_t k = 0; k < figure.lines.size(); ++k) {
    const CurveFigure::Line& line = figure.lines[k];
    html->Element(
        "path", {{"class", "line " + LineColor(line.name, k)}, {"d", PathOf(figure.time, line.value, x, y)}},
        [&] { html->Element("title", {}, line.name.empty() ? figure.name : line.name); });
  }
  html->Close();
}

void DrawRanges(const RangeFigure& figure, Markup* html) {
  constexpr double kWidth = 360, kHeight = 168, kLeft = 44, kRight = 350, kTop = 22, kBottom = 144;
  double low = std::numeric_limits<double>::infinity(), high = -low, end = 0;
  const auto include = [&](double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const RangeFigure::Line& line : figure.lines) {
    for (size_t i = 0; i < line.x.size(); ++i) {
      end = std::max(end, line.x[i]);
      for (const double value : {line.value[i], line.interval[i].lower, line.interval[i].upper})
        include(value);
    }
  }
  OpenFigure(kWidth, kHeight, figure.name, html);
  Label(kLeft, 12, "start", figure.name, html);
  if (!std::isfinite(low)) {
    Label((kLeft + kRight) / 2, (kTop + kBottom) / 2, "middle", "no values", html);
    html->Close();
    return;
  }
  if (low > 0 && low < 0.5 * high) low = 0;
  if (!IsRange(low, high)) high = low + std::max(1.0, std::abs(low) * 0.5);
  const Ticks values = TicksAround(low, high, 5);
  const Axis x{0, end > 0 ? end : 1, kLeft + 8, kRight - 8};
  const Axis y{values.at.front(), values.at.back(), kBottom, kTop};
  DrawGrid(values, y, kLeft, kRight, html);
  DrawScale(x, TicksWithin(x.from, x.to, 6), kBottom, figure.x_unit, html);
  for (size_t k = 0; k < figure.lines.size(); ++k) {
    const RangeFigure::Line& line = figure.lines[k];
    const std::string color = LineColor(line.name, k);
    // Lines are shifted horizontally, because lines with equal values would hide each other.
    const double shift = 3 * (static_cast<double>(k) - static_cast<double>(figure.lines.size() - 1) / 2);
    const Axis shifted{x.from, x.to, x.pixel_from + shift, x.pixel_to + shift};
    html->Element("path", {{"class", "line " + color}, {"d", PathOf(line.x, line.value, shifted, y)}},
                  [&] { html->Element("title", {}, line.name); });
    for (size_t i = 0; i < line.x.size(); ++i) {
      if (!std::isfinite(line.interval[i].lower)) continue;
      const double at = shifted(line.x[i]);
      Line("whisker " + color, at, y(line.interval[i].lower), at, y(line.interval[i].upper), html);
    }
  }
  html->Close();
}

void DrawShare(double share, double lower, double upper, bool scale, Markup* html, const char* css_class) {
  html->Open("svg", {{"class", scale ? "share scale" : "share"},
                     {"role", "img"},
                     {"aria-label", fmt::format("{}, interval {:.0f} to {:.0f} %", Percent(share),
                                                lower * 100, upper * 100)}});
  DrawBarOnTrack(share, css_class, html);
  const auto whisker = [&](double from, double to, const char* top, const char* bottom) {
    html->Empty("line", {{"class", "whisker"},
                         {"x1", CssPercent(from)},
                         {"x2", CssPercent(to)},
                         {"y1", top},
                         {"y2", bottom}});
  };
  whisker(lower, upper, "9", "9");
  for (const double bound : {lower, upper}) whisker(bound, bound, "5", "13");
  for (const int mark : {0, 25, 50, 75, 100}) {
    if (!scale) break;
    const std::string x = fmt::format("{}%", mark);
    html->Empty("line", {{"class", "axis"}, {"x1", x}, {"x2", x}, {"y1", "16"}, {"y2", "20"}});
    html->Element("text",
                  {{"x", x},
                   {"y", "32"},
                   {"text-anchor", mark == 0     ? "start"
                                   : mark == 100 ? "end"
                                                 : "middle"}},
                  fmt::format("{} %", mark));
  }
  html->Close();
}

void DrawRates(const RateFigure& figure, Markup* html) {
  constexpr double kWidth = 260, kHeight = 130, kLeft = 34, kRight = 250, kTop = 10, kBottom = 108;
  const double first = figure.bins.front().from, last = figure.bins.back().to;
  const Axis x{first, last, kLeft, kRight};
  const Axis y{0, 1, kBottom, kTop};
  std::string rates;
  for (const RateFigure::Bin& bin : figure.bins) rates += (rates.empty() ? "" : ", ") + Percent(bin.rate);
  OpenFigure(kWidth, kHeight, "success by " + figure.name + ": " + rates, html);
  if (figure.from < figure.to) {
    const double from = x(std::clamp(figure.from, first, last)), to = x(std::clamp(figure.to, first, last));
    html->Empty("rect", {{"class", "shaded"},
                         {"x", Px(from)},
                         {"y", Px(kTop)},
                         {"width", Px(to - from)},
                         {"height", Px(kBottom - kTop)}});
  }
  for (const double mark : {0.0, 0.5, 1.0}) {
    Line("grid", kLeft, y(mark), kRight, y(mark), html);
    Label(kLeft - 5, y(mark) + 4, "end", Percent(mark), html);
  }
  for (const RateFigure::Bin& bin : figure.bins) {
    const double middle = (x(bin.from) + x(bin.to)) / 2;
    html->Element("g", {{"class", "rate"}}, [&] {
      html->Element("title", {}, bin.title);
      Line("whisker", middle, y(bin.lower), middle, y(bin.upper), html);
      // A bin whose values are all equal appears as a dot only.
      Line("range", x(bin.from), y(bin.rate), x(bin.to), y(bin.rate), html);
      html->Empty("circle", {{"cx", Px(middle)}, {"cy", Px(y(bin.rate))}, {"r", "3.5"}});
    });
  }
  DrawScale(x, TicksWithin(first, last, 5), kBottom, figure.unit, html);
  html->Close();
}

void DrawBar(double share, const std::string& css_class, Markup* html) {
  html->Element("svg", {{"class", "share"}, {"aria-hidden", "true"}},
                [&] { DrawBarOnTrack(share, css_class, html); });
}

void DrawDifference(double difference, double lower, double upper, bool scale, const std::string& css_class,
                    Markup* html) {
  // Leaves a margin of 2 % on each side.
  const auto x = [](double value) { return CssPercent(0.5 + 0.48 * std::clamp(value, -1.0, 1.0)); };
  html->Element("svg", {{"class", scale ? "share scale" : "share"}, {"aria-hidden", "true"}}, [&] {
    for (const int points : {-100, -50, 0, 50, 100}) {
      if (!scale) break;
      const std::string at = x(points / 100.0);
      html->Empty("line", {{"class", "axis"}, {"x1", at}, {"x2", at}, {"y1", "16"}, {"y2", "20"}});
      html->Element("text", {{"x", at}, {"y", "32"}, {"text-anchor", "middle"}},
                    points == 0 ? "0" : WithMinus(fmt::format("{:+}", points)));
    }
    html->Empty("line", {{"class", "axis"}, {"x1", "50%"}, {"x2", "50%"}, {"y1", "0"}, {"y2", "18"}});
    html->Empty(
        "line",
        {{"class", "effect " + css_class}, {"x1", x(lower)}, {"x2", x(upper)}, {"y1", "9"}, {"y2", "9"}});
    html->Empty("circle", {{"class", "effect " + css_class}, {"cx", x(difference)}, {"cy", "9"}, {"r", "4"}});
  });
}

}  // namespace evalbus::report
