// Relative changes of several quantities on one logarithmic axis: x0.5, 1, x2, x5, x10.
#pragma once

#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "report/page/markup.h"

namespace evalbus::report {

class RatioAxis {
 public:
  // Extends the axis, which includes 0.5 to 2, to this ratio and its interval, within 0.1 to 10. Ratios
  // beyond are drawn as an arrow at its end.
  void Include(double ratio, const metrics::Interval& interval);

  // Draws the labels of the axis.
  void DrawLabels(Markup* html) const;
  // Draws a ratio as a dot, and its interval, if it is finite, as a line. css_class: of the judgment.
  void Draw(double ratio, const metrics::Interval& interval, const std::string& css_class,
            Markup* html) const;

  // Ratios with a label, ascending.
  std::vector<double> ticks() const;

 private:
  // Position from 0 to 1.
  double At(double ratio) const;
  void DrawTicks(Markup* html) const;

  double least_ = 0.5, most_ = 2;
};

// "×1.86"; "×1.9" if the interval is too wide for more digits.
std::string RatioText(double ratio, const metrics::Interval& interval);

}  // namespace evalbus::report
