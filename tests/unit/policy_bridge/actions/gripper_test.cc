#include "policy_bridge/actions/gripper.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/errors.h"

namespace evalbus::policy::gripper_test {

struct Said {
  double value, closing;
};

struct Convention {
  const char* name;
  double open, closed;
  bool has_threshold;
  std::vector<Said> said;
};

// Checks each row of the table of conventions: the value of a policy of that kind and its meaning.
TEST(Gripper, CommandsOfEachConvention) {
  const Convention conventions[] = {
      {"evalbus opening", 1, 0, false, {{1, 0}, {0.25, 0.75}, {0, 1}}},
      {"RoboEval command", 0, 1, true, {{0, 0}, {0.49, 0}, {0.5, 0}, {0.51, 1}, {1, 1}, {1.2, 1}, {-0.2, 0}}},
      {"DROID", 0, 1, true, {{0, 0}, {0.4, 0}, {0.6, 1}, {1, 1}}},
      {"LIBERO", -1, 1, true, {{-1, 0}, {-0.1, 0}, {0.1, 1}, {1, 1}}},
      {"OpenVLA raw", 1, 0, true, {{1, 0}, {0.6, 0}, {0.4, 1}, {0, 1}}},
      {"GR00T gripper_close", 0, 1, false, {{0, 0}, {0.3, 0.3}, {1, 1}}},
      {"finger meters", 0.04, 0, false, {{0.04, 0}, {0.01, 0.75}, {0, 1}}},
      // The sim clips and counts values beyond the gripper's range.
      {"beyond its ends", 0, 1, false, {{-0.5, -0.5}, {1.5, 1.5}}},
  };
  for (const Convention& convention : conventions) {
    GripperForm form{.index = 0, .open = convention.open, .closed = convention.closed};
    if (convention.has_threshold) form.threshold = 0.5;
    for (const Said& said : convention.said) {
      GripperCommand command(form);
      EXPECT_NEAR(command.Step(said.value), said.closing, 1e-12) << convention.name << " " << said.value;
    }
    EXPECT_NEAR(ValueOf(form, 0), convention.open, 1e-12);
    EXPECT_NEAR(ValueOf(form, 1), convention.closed, 1e-12);
    EXPECT_NEAR(ClosingOf(form, ValueOf(form, 0.3)), 0.3, 1e-12);
  }
}

std::vector<double> Steps(const GripperForm& form, const std::vector<double>& values) {
  GripperCommand command(form);
  std::vector<double> closings;
  for (double value : values) closings.push_back(command.Step(value));
  return closings;
}

TEST(Gripper, StickyWaitsForStepsInARow) {
  GripperForm form{.index = 0, .open = 0, .closed = 1, .threshold = 0.5, .sticky_steps = 3};
  // The first two closing steps are interrupted, so the gripper closes at the third of the next three.
  // Opening also takes three steps.
  EXPECT_EQ(Steps(form, {1, 1, 0, 1, 1, 1, 0, 1, 0, 0, 0, 0}),
            (std::vector<double>{0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 0, 0}));
  form.sticky_steps = 1;
  EXPECT_EQ(Steps(form, {1, 0, 1}), (std::vector<double>{1, 0, 1}));
}

TEST(Gripper, BeginForgets) {
  GripperCommand command({.index = 0, .open = 0, .closed = 1, .threshold = 0.5, .sticky_steps = 2});
  command.Step(1);
  command.Begin();
  EXPECT_EQ(command.Step(1), 0);
  EXPECT_EQ(command.Step(1), 1);
  command.Begin();
  EXPECT_EQ(command.Step(1), 0);
}

std::string Error(const GripperForm& form) {
  try {
    GripperCommand command(form);
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(Gripper, BlocksThatMeanNothingAreNamed) {
  EXPECT_EQ(Error({.open = 1, .closed = 1}),
            "gripper: expected two different, finite numbers for open and closed, got 1 and 1");
  EXPECT_EQ(Error({.open = std::nan(""), .closed = 1}),
            "gripper: expected two different, finite numbers for open and closed, got nan and 1");
  EXPECT_EQ(Error({.threshold = 1.0}),
            "gripper: expected a threshold of the closed fraction from 0 to below 1, got 1");
  EXPECT_EQ(Error({.threshold = -0.1}),
            "gripper: expected a threshold of the closed fraction from 0 to below 1, got -0.1");
  EXPECT_EQ(Error({.threshold = 0.5, .sticky_steps = 0}), "gripper: expected at least 1 sticky step, got 0");
  EXPECT_EQ(Error({.sticky_steps = 2}), "gripper: more than 1 sticky step requires a threshold");
  EXPECT_EQ(Error({.threshold = 0.0}), "none");
}

}  // namespace evalbus::policy::gripper_test
