// Draws relative changes of several quantities on one logarithmic axis with labels such as ×0.5, 1, ×2 and
// ×5.
#pragma once

#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "report/page/markup.h"

namespace evalbus::report {

class RatioAxis {
 public:
  // Extends the axis to include this ratio and its interval. The axis always includes 0.5 to 2, and never
  // exceeds 0.1 to 10. Ratios outside it are drawn as an arrow at its end.
  void Include(double ratio, const metrics::Interval& interval);

  // Draws the labels of the axis.
  void DrawLabels(Markup* html) const;
  // Draws a ratio as a dot, and its interval, if it is finite, as a line. css_class: CSS class of the
  // judgment.
  void Draw(double ratio, const metrics::Interval& interval, const std::string& css_class,
            Markup* html) const;

  // Returns the ratios that have a label, ascending.
  std::vector<double> ticks() const;

 private:
  // Returns the position on the axis, from 0 to 1.
  double At(double ratio) const;
  void DrawTicks(Markup* html) const;

  double least_ = 0.5, most_ = 2;
};

// Formats a ratio, for example as "×1.86", or as "×1.9" if the interval is too wide for more digits.
std::string RatioText(double ratio, const metrics::Interval& interval);

}  // namespace evalbus::report
