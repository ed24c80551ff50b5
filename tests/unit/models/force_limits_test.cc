#include "models/force_limits.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"

namespace evalbus::force_limits_test {

TEST(ForceLimits, AreReadByRegion) {
  const auto limits = ParseForceLimits(
      "limits:\n"
      "  hand:\n"
      "    bodies: [person/left_hand, person/right_hand]\n"
      "    quasi_static_force_N: 140\n"
      "    transient_force_N: 280\n"
      "    transient_s: 0.25\n"
      "  counter: {bodies: [counter], quasi_static_force_N: 65.5, transient_force_N: 65.5}\n",
      "limits.yaml");
  ASSERT_EQ(limits.size(), 2u);
  EXPECT_EQ(limits[0].region, "hand");
  EXPECT_EQ(limits[0].bodies, (std::vector<std::string>{"person/left_hand", "person/right_hand"}));
  EXPECT_EQ(limits[0].locations[1].line, 3);
  EXPECT_EQ(limits[0].quasi_static_force, 140);
  EXPECT_EQ(limits[0].transient_force, 280);
  EXPECT_EQ(limits[0].transient_time, 0.25);
  EXPECT_EQ(limits[1].region, "counter");
  EXPECT_EQ(limits[1].transient_time, 0.5);
  EXPECT_TRUE(std::isinf(limits[1].grip_force));
}

TEST(ForceLimits, OfGripsNeedNoOthers) {
  const auto limits = ParseForceLimits(
      "limits:\n"
      "  egg: {bodies: [egg], grip_force_N: 15}\n"
      "  cup: {bodies: [cup], grip_force_N: 20, quasi_static_force_N: 30, transient_force_N: 40}\n",
      "limits.yaml");
  ASSERT_EQ(limits.size(), 2u);
  EXPECT_EQ(limits[0].grip_force, 15);
  EXPECT_TRUE(std::isinf(limits[0].quasi_static_force) && std::isinf(limits[0].transient_force));
  EXPECT_EQ(limits[1].grip_force, 20);
  EXPECT_EQ(limits[1].transient_force, 40);
}

TEST(ForceLimits, ErrorsAreOneLineWithFileLineAndKey) {
  const auto error_of = [](const std::string& yaml) -> std::string {
    try {
      ParseForceLimits(yaml, "limits.yaml");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of("limits: {}\n"), "limits.yaml:1: key 'limits': expected at least one region");
  const std::string head = "limits:\n  hand:\n    bodies: [a]\n";
  EXPECT_EQ(error_of(head + "    quasi_static_force_N: 9\n    transient_force_N: -2\n"),
            "limits.yaml:5: key 'transient_force_N': expected a number > 0, got '-2'");
  EXPECT_EQ(error_of(head + "    quasi_static_force_N: 9\n    transient_force_N: 8\n"),
            "limits.yaml:5: key 'transient_force_N': expected at least quasi_static_force_N");
  EXPECT_NE(error_of(head + "    quasi_static_force_N: 9\n").find("transient_force_N"), std::string::npos);
  EXPECT_NE(
      error_of(head + "    quasi_static_force: 9\n    transient_force_N: 8\n").find("quasi_static_force"),
      std::string::npos);
  EXPECT_EQ(error_of(head + "    grip_force_N: 0\n"),
            "limits.yaml:4: key 'grip_force_N': expected a number > 0, got '0'");
  EXPECT_EQ(error_of(head + "    grip_force_N: 9\n    transient_force_N: 9\n"),
            "limits.yaml:2: key 'quasi_static_force_N': required here, but missing in 'hand'");
  EXPECT_EQ(
      error_of("limits:\n  hand:\n    bodies: []\n    quasi_static_force_N: 1\n    transient_force_N: 1\n"),
      "limits.yaml:3: key 'bodies': expected at least one body");
}

}  // namespace evalbus::force_limits_test
