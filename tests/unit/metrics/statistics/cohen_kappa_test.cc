#include "metrics/statistics/cohen_kappa.h"

#include <gmock/gmock.h>

namespace evalbus::metrics::cohen_kappa_test {

using testing::DoubleEq;
using testing::Optional;

// By hand, p_o = 35 / 50, p_e = (25 * 30 + 25 * 20) / 50^2 = 0.5, and kappa = 0.2 / 0.5.
TEST(CohenKappa, AgreesWithAWorkedTable) {
  EXPECT_THAT(CohenKappa({.both = 20, .only_a = 5, .only_b = 10, .neither = 15}), Optional(DoubleEq(0.4)));
}

TEST(CohenKappa, HasItsExtremesAndItsZero) {
  EXPECT_THAT(CohenKappa({.both = 7, .neither = 3}), Optional(DoubleEq(1)));
  EXPECT_THAT(CohenKappa({.only_a = 5, .only_b = 5}), Optional(DoubleEq(-1)));
  // Independent raters rate 1/2 and 1/4 of the episodes as successes.
  EXPECT_THAT(CohenKappa({.both = 1, .only_a = 3, .only_b = 1, .neither = 3}), Optional(DoubleEq(0)));
  // One rater always rates success, so agreement is at chance level.
  EXPECT_THAT(CohenKappa({.both = 9, .only_a = 1}), Optional(DoubleEq(0)));
}

TEST(CohenKappa, IsUndefinedWithoutEpisodesOrWithOneVerdictForAll) {
  EXPECT_EQ(CohenKappa({}), std::nullopt);
  EXPECT_EQ(CohenKappa({.both = 10}), std::nullopt);
  EXPECT_EQ(CohenKappa({.neither = 4}), std::nullopt);
}

}  // namespace evalbus::metrics::cohen_kappa_test
