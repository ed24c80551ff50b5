// The figures of a report as inline SVG. Colors, fonts and line widths are those of report.css, so that one
// figure serves light and dark, screen and paper. What the eye sees in a figure, its <title>s say in words.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viz/report/markup.h"

namespace evalbus::viz {

// Distribution of a metric over episodes: stacked bars, and above them the 5th to 95th percentile with the
// median.
struct HistogramFigure {
  std::string name;
  std::string unit;  // empty: a count or share
  // Values of the episodes that succeeded and of those that did not. Not all equal.
  std::vector<double> succeeded, failed;
  double p5 = 0, median = 0, p95 = 0;
};
void DrawHistogram(const HistogramFigure& figure, Markup* html);

// A moment of an episode.
struct EpisodeEvent {
  enum class Kind { kStage, kSlip, kCollision, kEnd };
  Kind kind = Kind::kEnd;
  double time = 0;   // s since the episode began
  std::string text;  // what happened
};
// The mark of a kind of event, as SVG to stand in text.
void DrawEventMark(EpisodeEvent::Kind kind, Markup* html);

// Values over the time of an episode.
struct CurveFigure {
  std::string name;
  std::string unit;
  std::vector<double> time;  // s, ascending
  struct Line {
    std::string name;           // "left"; may be empty for a single one
    std::vector<double> value;  // one per time; NaN where there is none
  };
  std::vector<Line> lines;
  std::vector<EpisodeEvent> events;
};
// At least one value has to be finite.
void DrawCurves(const CurveFigure& figure, Markup* html);

// A share with its interval on a scale from 0 to 100 %; with marks of the scale where `scale` is true.
void DrawShare(double share, double lower, double upper, bool scale, Markup* html);
// A share alone.
void DrawBar(double share, const std::string& css_class, Markup* html);

// A difference with its interval, in -1 to 1, around a line at 0.
void DrawDifference(double difference, double lower, double upper, const std::string& css_class,
                    Markup* html);

// Maps [from, to] of values to pixels.
struct Axis {
  double from, to;
  double pixel_from, pixel_to;
  double operator()(double value) const {
    return pixel_from + (value - from) / (to - from) * (pixel_to - pixel_from);
  }
};

// "M1 2L3 4.5": the points in pixels with one decimal; a new M after values that are not finite. Points that
// lie within a quarter of a pixel of the line through those that stay are left out.
std::string PathOf(std::span<const double> x, std::span<const double> y, const Axis& x_axis,
                   const Axis& y_axis);

}  // namespace evalbus::viz
