#include "sim/readiness_tracker.h"

#include <gtest/gtest.h>

namespace evalbus::sim::readiness_tracker_test {

class ReadinessTrackerTest : public testing::Test {
 protected:
  ReadinessTrackerTest() { dut_.Begin(Start(3, 1, {"metrics", "policy"}), 7); }

  static command_t Start(int episode, int attempt, const std::vector<std::string>& required,
                         const std::vector<int64_t>& instances = {}) {
    command_t start{};
    start.episode = episode;
    start.attempt = attempt;
    start.required_component = required;
    start.required_instance = instances;
    return start;
  }

  bool Update(const std::string& component, int8_t state = component_status_t::READY, int64_t instance = 1,
              int64_t last_tick = -1, int64_t window = 0) {
    component_status_t status{};
    status.component = component;
    status.instance = instance;
    status.state = state;
    status.episode = episode_;
    status.attempt = attempt_;
    status.last_tick = last_tick;
    status.lag_window_ticks = window;
    return dut_.Update(status);
  }

  ReadinessTracker dut_;
  int episode_ = 3, attempt_ = 1;
};

TEST_F(ReadinessTrackerTest, NamesTheComponentsThatAreNotReady) {
  EXPECT_EQ(dut_.Missing(), "metrics, policy");
  Update("policy");
  EXPECT_EQ(dut_.Missing(), "metrics");
  Update("metrics", component_status_t::IDLE);
  EXPECT_EQ(dut_.Missing(), "metrics");
  Update("metrics");
  EXPECT_EQ(dut_.Missing(), "");
}

TEST_F(ReadinessTrackerTest, ReadyForAnotherAttemptIsNotReady) {
  attempt_ = 0;
  Update("metrics");
  Update("policy");
  EXPECT_EQ(dut_.Missing(), "metrics, policy");
}

TEST_F(ReadinessTrackerTest, NamesTheComponentsThatLag) {
  Update("recorder", component_status_t::READY, 1, 10, 256);
  Update("metrics", component_status_t::READY, 1, 0, 0);
  EXPECT_EQ(dut_.Lagging(265), "");
  EXPECT_EQ(dut_.Lagging(266), "recorder");
}

TEST_F(ReadinessTrackerTest, LastTicksAreThoseOfThisEpisode) {
  Update("collision", component_status_t::READY, 1, 12);
  EXPECT_EQ(dut_.LastTick("collision"), 12);
  EXPECT_EQ(dut_.LastTick("metrics"), -1);
  dut_.Begin(Start(4, 0, {}), 7);
  EXPECT_EQ(dut_.LastTick("collision"), -1);
}

TEST_F(ReadinessTrackerTest, TwoProcessesOfOneNameAreFound) {
  Update("policy", component_status_t::READY, 1);
  Update("policy", component_status_t::READY, 1);
  EXPECT_EQ(dut_.twice(), "");
  Update("policy", component_status_t::READY, 2);
  EXPECT_EQ(dut_.twice(), "policy");
  // Readiness in a finished episode does not count for the next one.
  dut_.Begin(Start(4, 0, {"policy"}), 7);
  EXPECT_EQ(dut_.twice(), "");
}

// The other process may be ready before the one that the launcher started.
TEST_F(ReadinessTrackerTest, AnotherProcessThanTheRequiredOneIsFound) {
  dut_.Begin(Start(3, 1, {"metrics", "policy"}, {0, 5}), 7);
  Update("metrics", component_status_t::READY, 1);
  EXPECT_FALSE(Update("policy", component_status_t::IDLE, 6));
  EXPECT_EQ(dut_.twice(), "");
  EXPECT_FALSE(Update("policy", component_status_t::READY, 6));
  EXPECT_EQ(dut_.twice(), "policy");
  EXPECT_EQ(dut_.Missing(), "policy");
  EXPECT_TRUE(Update("policy", component_status_t::READY, 5));
  EXPECT_EQ(dut_.Missing(), "");
}

TEST_F(ReadinessTrackerTest, ComponentsThatAreNotRequiredMayRunTwice) {
  Update("viz", component_status_t::READY, 1);
  Update("viz", component_status_t::READY, 2);
  EXPECT_EQ(dut_.twice(), "");
  Update("policy", component_status_t::IDLE, 1);
  Update("policy", component_status_t::READY, 2);
  EXPECT_EQ(dut_.twice(), "");
}

TEST_F(ReadinessTrackerTest, ASecondSimIsFound) {
  Update("sim", component_status_t::READY, 7);
  EXPECT_EQ(dut_.twice(), "");
  Update("sim", component_status_t::READY, 8);
  EXPECT_EQ(dut_.twice(), "sim");
}

TEST_F(ReadinessTrackerTest, InventedNamesAreNotKept) {
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += Update("component_" + std::to_string(i));
  EXPECT_EQ(taken, 100);
  EXPECT_TRUE(Update("metrics"));
}

}  // namespace evalbus::sim::readiness_tracker_test
