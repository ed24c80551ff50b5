#include "report/page/ratio_axis.h"

#include <gmock/gmock.h>

#include <limits>

namespace evalbus::report::ratio_axis_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string Drawn(const RatioAxis& axis, double ratio, const metrics::Interval& interval) {
  Markup html;
  axis.Draw(ratio, interval, "worse", &html);
  return html.str();
}

TEST(RatioAxis, EndsOnLabelsAroundItsRatios) {
  RatioAxis axis;
  EXPECT_THAT(axis.ticks(), ElementsAre(0.5, 1, 2));
  axis.Include(1.4, {kNan, kNan});
  EXPECT_THAT(axis.ticks(), ElementsAre(0.5, 1, 2));
  axis.Include(1.9, {1.2, 2.5});
  EXPECT_THAT(axis.ticks(), ElementsAre(0.5, 1, 2, 5));
  axis.Include(0.3, {kNan, kNan});
  EXPECT_THAT(axis.ticks(), ElementsAre(0.2, 0.5, 1, 2, 5));
  axis.Include(156, {100, 200});
  EXPECT_THAT(axis.ticks(), ElementsAre(0.2, 0.5, 1, 2, 5, 10));
  axis.Include(0.001, {kNan, kNan});
  EXPECT_THAT(axis.ticks(), ElementsAre(0.1, 0.2, 0.5, 1, 2, 5, 10));
}

// On an axis from 0.5 to 2, the ratio 1 is in the middle. 4 % of the width are free on each side.
TEST(RatioAxis, IsLogarithmic) {
  const RatioAxis axis;
  EXPECT_THAT(Drawn(axis, 1, {0.5, 2}), HasSubstr("x1=\"4.00%\" x2=\"96.00%\" y1=\"9\""));
  EXPECT_THAT(Drawn(axis, 1, {0.5, 2}), HasSubstr("cx=\"50.00%\""));
  // sqrt(2) is three quarters of the way.
  EXPECT_THAT(Drawn(axis, 1.41421356, {kNan, kNan}), HasSubstr("cx=\"73.00%\""));
}

TEST(RatioAxis, DrawsAnArrowForWhatIsBeyond) {
  RatioAxis axis;
  axis.Include(156, {100, 200});
  EXPECT_THAT(Drawn(axis, 156, {100, 200}), HasSubstr("▶"));
  EXPECT_THAT(Drawn(axis, 156, {100, 200}), Not(HasSubstr("circle")));
  EXPECT_THAT(Drawn(axis, 9, {8, 20}), HasSubstr("circle"));
}

TEST(RatioText, HasAsManyDigitsAsTheIntervalBears) {
  EXPECT_EQ(RatioText(1.8649, {1.8, 1.9}), "×1.86");
  EXPECT_EQ(RatioText(1.2999, {1.25, 1.35}), "×1.30");
  EXPECT_EQ(RatioText(1.8649, {1.2, 3.1}), "×1.86");
  EXPECT_EQ(RatioText(3.8649, {0.1, 80}), "×4");
  EXPECT_EQ(RatioText(21.649, {21, 22}), "×21.6");
  EXPECT_EQ(RatioText(0.5, {kNan, kNan}), "×0.50");
}

}  // namespace evalbus::report::ratio_axis_test
