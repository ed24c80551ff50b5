// Draws the figures of a report as inline SVG. Colors, fonts and line widths are defined in report.css, so
// that one figure works in light and dark mode, on screen and on paper. Labels and <title> elements describe
// the figures in words.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "report/page/markup.h"

namespace evalbus::report {

// Distribution of a metric over episodes, as stacked bars. The 5th to 95th percentile and the median are
// drawn above the bars.
struct HistogramFigure {
  std::string name;
  std::string unit;  // empty for counts and shares
  // Values of successful and of failed episodes. They must not all be equal.
  std::vector<double> succeeded, failed;
  double p5 = 0, median = 0, p95 = 0;
};
void DrawHistogram(const HistogramFigure& figure, Markup* html);

// An event at one point in time of an episode.
struct EpisodeEvent {
  enum class Kind { kStage, kSlip, kCollision, kEnd };
  Kind kind = Kind::kEnd;
  double time = 0;   // s since the episode began
  std::string text;  // what happened
};
// Draws the mark of an event kind as SVG for use within text.
void DrawEventMark(EpisodeEvent::Kind kind, Markup* html);

// Returns the CSS class for the color of a figure's line. As in the viewer, the lines of the left and of the
// right arm have the color of the arm. Other lines have colors that have no other meaning. name: may be empty
// for a single line.
std::string LineColor(const std::string& name, size_t index);

// Values over the time of an episode.
struct CurveFigure {
  std::string name;
  std::string unit;
  std::vector<double> time;  // s, ascending
  struct Line {
    std::string name;           // "left"; may be empty for a single one
    std::vector<double> value;  // one value per time; NaN if unavailable
  };
  std::vector<Line> lines;
  std::vector<EpisodeEvent> events;
};
// Draws the curves. At least one value must be finite.
void DrawCurves(const CurveFigure& figure, Markup* html);

// Means with intervals as functions of a non-negative quantity.
struct RangeFigure {
  std::string name;    // name of the values, with their unit
  std::string x_unit;  // unit of the horizontal axis
  struct Line {
    std::string name;
    std::vector<double> x;      // ascending
    std::vector<double> value;  // NaN if unavailable
    std::vector<metrics::Interval> interval;
  };
  std::vector<Line> lines;
};
void DrawRanges(const RangeFigure& figure, Markup* html);

// Draws a share with its interval on a scale from 0 to 100 %. scale: whether tick marks are drawn.
void DrawShare(double share, double lower, double upper, bool scale, Markup* html,
               const char* css_class = "good");
// Draws a share without interval.
void DrawBar(double share, const std::string& css_class, Markup* html);

// Success rate as a function of a parameter.
struct RateFigure {
  std::string name;
  std::string unit;
  struct Bin {
    double from = 0, to = 0;
    double rate = 0, lower = 0, upper = 0;
    std::string title;  // tooltip of the bin
  };
  std::vector<Bin> bins;  // ascending; the first and the last differ
  // Values of the parameter between which the figure is shaded, clipped to the axis; equal: not shaded.
  double from = 0, to = 0;
};
void DrawRates(const RateFigure& figure, Markup* html);

// Draws a difference with its interval around a line at 0. All values are within -1 to 1. scale: whether tick
// marks in percentage points are drawn.
void DrawDifference(double difference, double lower, double upper, bool scale, const std::string& css_class,
                    Markup* html);

// Maps values from `from` to `to` linearly to pixels.
struct Axis {
  double from, to;
  double pixel_from, pixel_to;
  double operator()(double value) const {
    return pixel_from + (value - from) / (to - from) * (pixel_to - pixel_from);
  }
};

// Returns an SVG path such as "M1 2L3 4.5" in pixels with one decimal. After values that are not finite, a
// new subpath starts. The path is simplified: points within a quarter of a pixel of it are omitted.
std::string PathOf(std::span<const double> x, std::span<const double> y, const Axis& x_axis,
                   const Axis& y_axis);

}  // namespace evalbus::report
