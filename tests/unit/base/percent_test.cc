#include <gtest/gtest.h>

#include <limits>

#include "base/text.h"

namespace evalbus::percent_test {

TEST(Percent, RoundsHalvesUp) {
  EXPECT_EQ(Percent(33.0 / 40), "83 %");  // rounds 82.5
  EXPECT_EQ(Percent(1.0 / 8), "13 %");    // rounds 12.5
  EXPECT_EQ(Percent(0), "0 %");
  EXPECT_EQ(Percent(1), "100 %");
  EXPECT_EQ(Percent(std::numeric_limits<double>::quiet_NaN()), "-");
}

// tests/browser/check_viewer.py compares the page's function for the same integers.
TEST(Percent, IsExactForAllRates) {
  for (int n = 1; n <= 200; ++n) {
    for (int k = 0; k <= n; ++k) {
      EXPECT_EQ(Percent(static_cast<double>(k) / n), std::to_string((200 * k + n) / (2 * n)) + " %")
          << k << " of " << n;
    }
  }
}

// Evalbus.points in the browser rounds in the same way. tests/browser/page_functions.js tests it with some of
// these numbers.
TEST(PercentagePoints, RoundHalvesAwayFromZero) {
  EXPECT_EQ(PercentagePoints(-0.125), "-13");
  EXPECT_EQ(PercentagePoints(0.125), "13");
  EXPECT_EQ(PercentagePoints(0.005), "1");
  EXPECT_EQ(PercentagePoints(-0.004), "0");
  EXPECT_EQ(PercentagePoints(0.375), "38");
  EXPECT_EQ(PercentagePoints(0.0125, 1), "1.3");
  EXPECT_EQ(PercentagePoints(-0.0125, 1), "-1.3");
  EXPECT_EQ(PercentagePoints(NAN), "-");
}

// Readers subtract the rates. Evalbus.pointDecimals in the browser has the same test.
TEST(PointDecimals, WholePointsNeverContradictTheRates) {
  EXPECT_EQ(PointDecimals(1, 3.0 / 8), 1);  // 100 % and 38 % (37.5), 62.5 points
  EXPECT_EQ(PointDecimals(2.0 / 3, 1.0 / 3), 1);
  EXPECT_EQ(PointDecimals(0.75, 0.25), 0);
  EXPECT_EQ(PointDecimals(std::numeric_limits<double>::quiet_NaN(), 1), 0);
  for (int n = 1; n <= 200; ++n) {
    for (int a = 0; a <= n; ++a) {
      for (int b = 0; b <= a; ++b) {
        const auto rounded = [n](int k) { return (200 * k + n) / (2 * n); };
        const int expected = rounded(a - b) == rounded(a) - rounded(b) ? 0 : 1;
        const double high = static_cast<double>(a) / n, low = static_cast<double>(b) / n;
        ASSERT_EQ(PointDecimals(high, low), expected) << a << ", " << b << " of " << n;
        ASSERT_EQ(PointDecimals(low, high), expected) << b << ", " << a << " of " << n;
      }
    }
  }
}

}  // namespace evalbus::percent_test
