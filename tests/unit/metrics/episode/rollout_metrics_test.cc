// Tests the accumulators with cases whose results were computed by hand.
#include "metrics/episode/rollout_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "lcmtypes/extended_value.h"
#include "lcmtypes/metric_catalog.h"
#include "metrics/episode/result_json.h"
#include "metrics/statistics/run_statistics.h"
#include "tests/unit/allocation_count.h"

namespace evalbus::metrics::rollout_metrics_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = std::numbers::pi;

// Owners of geoms: 0 floor, 1 table, 2 to 4 robot, 5 pot.
const std::vector<GeomOwner> kOwners = {GeomOwner::kScene, GeomOwner::kScene, GeomOwner::kRobot,
                                        GeomOwner::kRobot, GeomOwner::kRobot, GeomOwner::kObject};

MetricsConfig TwoArms() {
  MetricsConfig config;
  for (const char* name : {"left", "right"}) {
    config.arms.push_back({.name = name, .num_joints = 2, .joint_lower = {-1, -1}, .joint_upper = {1, 1}});
  }
  config.grippers = {"left", "right"};
  config.objects = {"pot", "lid"};
  config.geom_owner = kOwners;
  config.control_dt = 0.5;
  config.slip_sample_window = 1;
  config.stages = {{.index = 1, .name = "grasp"}, {.index = 2, .name = "lift"}};
  config.target_distances = {"lift", "goal"};
  config.pose_errors = {""};
  return config;
}

// A sample with its own storage. Everything is at rest at zero, and the grippers are half open.
struct TestSample {
  std::vector<std::vector<double>> q{2, {0, 0}}, w{2, {0, 0}};
  std::vector<std::optional<double>> work{0, 0};
  std::vector<std::array<double, 3>> p{2, {0, 0, 0}};
  std::vector<std::array<double, 4>> quat{2, {1, 0, 0, 0}};
  std::vector<double> opening{0.5, 0.5};
  std::vector<uint8_t> holding{0, 0, 0, 0};
  std::vector<uint8_t> pinched{0, 0, 0, 0};
  std::vector<GeomContact> contacts;
  std::optional<double> clearance;
  std::vector<ArmSample> arm = std::vector<ArmSample>(2);

  Sample At(int64_t tick) {
    for (size_t k = 0; k < arm.size(); ++k) arm[k] = {q[k], w[k], p[k], quat[k], work[k]};
    return {.tick = tick,
            .time = 0.5 * tick,
            .arm = arm,
            .gripper_opening = opening,
            .holding = holding,
            .pinched = pinched,
            .contacts = contacts,
            .clearance = clearance};
  }
};

class RolloutMetricsTest : public testing::Test {
 protected:
  void Start() { dut_.Start(sample_.opening, sample_.holding); }
  bool Step() { return dut_.Step(sample_.At(++tick_)); }
  metric_values_t Values() const {
    metric_values_t values{};
    dut_.Values(&values);
    return values;
  }
  static extended_metrics_t ExtendedOf(const RolloutMetrics& metrics) {
    extended_metrics_t extended{};
    extended.name = metrics.extended().names();
    extended.unit = metrics.extended().units();
    metrics.extended().Values(&extended.value_mixed);
    return extended;
  }
  extended_metrics_t Extended() const { return ExtendedOf(dut_); }
  double Extended(const std::string& name) const { return ExtendedValue(Extended(), name); }
  void SetHolding(int object, int gripper, bool held) { sample_.holding[object * 2 + gripper] = held; }

  RolloutMetrics dut_{TwoArms()};
  TestSample sample_;
  int64_t tick_ = 0;
};

TEST_F(RolloutMetricsTest, AddsUpPathsPerArmFromTheSecondSampleOn) {
  Start();
  sample_.p[0] = {10, 0, 0};  // the position of the first sample does not matter
  Step();
  sample_.p[0] = {10, 3, 4};
  sample_.q[0] = {0.3, 0.4};
  sample_.q[1] = {kPi, 0};  // the angle is not unwrapped
  sample_.quat[0] = {0, 0, 0, 1};
  Step();
  sample_.p[0] = {10, 3, 3};
  sample_.q[1] = {-kPi, 0};
  sample_.quat[0] = {0, 0, 0, -2};  // the same orientation, not normalized
  Step();

  EXPECT_DOUBLE_EQ(Values().cartesian_path_length_m[0], 6);
  EXPECT_EQ(Values().cartesian_path_length_m[1], 0);
  EXPECT_DOUBLE_EQ(Values().joint_path_length_rad[0], 0.5);
  EXPECT_DOUBLE_EQ(Values().joint_path_length_rad[1], 3 * kPi);
  EXPECT_DOUBLE_EQ(Values().orientation_path_length_rad[0], kPi);
  EXPECT_EQ(Values().num_samples, 3);
  EXPECT_EQ(Values().completion_time_s, 1.5);
}

TEST_F(RolloutMetricsTest, AStillWristOfSinglePrecisionHasNoOrientationPath) {
  Start();
  for (int k = 0; k < 1000; ++k) {
    const double noise = (k % 7 - 3) * 2e-8;  // norm off by up to 6e-8
    const double scale = 1 + noise;
    sample_.quat[0] = {0.5 * scale, 0.5 * scale, -0.5 * scale, 0.5 * scale};
    Step();
  }
  EXPECT_LT(Values().orientation_path_length_rad[0], 1e-12);
}

TEST_F(RolloutMetricsTest, JerkIsTheThirdDifferenceFromTheFourthSampleOn) {
  Start();
  for (int k = 0; k < 3; ++k) {
    sample_.p[0][0] = k * k * k;
    Step();
  }
  EXPECT_EQ(Values().num_jerk_samples, 0);
  EXPECT_EQ(Values().avg_cartesian_jerk_mps3[0], 0);
  // The third difference of k^3 is 6, which is divided by 0.5^3.
  sample_.p[0][0] = 27;
  Step();
  EXPECT_DOUBLE_EQ(Values().avg_cartesian_jerk_mps3[0], 48);
  // A position of 64 would give 48 again; 65 gives 7 / 0.125 = 56.
  sample_.p[0][0] = 65;
  Step();
  EXPECT_EQ(Values().num_jerk_samples, 2);
  EXPECT_DOUBLE_EQ(Values().avg_cartesian_jerk_mps3[0], 52);
  EXPECT_DOUBLE_EQ(Values().rms_cartesian_jerk_mps3[0], std::sqrt((48. * 48 + 56 * 56) / 2));
  EXPECT_DOUBLE_EQ(Values().overall_avg_cartesian_jerk_mps3, 26);
  EXPECT_DOUBLE_EQ(Values().overall_rms_cartesian_jerk_mps3, std::sqrt((48. * 48 + 56 * 56) / 4));
  EXPECT_EQ(Values().avg_cartesian_jerk_mps3[1], 0);
}

TEST_F(RolloutMetricsTest, JerkOfAnArmAtRestIsNothing) {
  Start();
  sample_.p = {{0.3, -0.7, 1.1}, {1e3 / 3, 1e-7 / 3, 0.1}};
  sample_.q = {{0.1, -2.3}, {0.7, 1e2 / 3}};
  for (int k = 0; k < 9; ++k) ASSERT_TRUE(Step());
  const metric_values_t values = Values();
  EXPECT_EQ(values.num_jerk_samples, 6);
  for (const auto* jerk : {&values.avg_cartesian_jerk_mps3, &values.rms_cartesian_jerk_mps3,
                           &values.avg_joint_jerk_radps3, &values.rms_joint_jerk_radps3}) {
    EXPECT_EQ(*jerk, (std::vector<double>{0, 0}));
  }
  EXPECT_EQ(values.overall_rms_cartesian_jerk_mps3, 0);
  EXPECT_EQ(values.overall_rms_joint_jerk_radps3, 0);
}

TEST_F(RolloutMetricsTest, JerkOverAGapOfTicksIsNotCounted) {
  Start();
  for (int k = 0; k < 3; ++k) Step();
  tick_ += 1;
  sample_.p[0][0] = 5;
  for (int k = 0; k < 3; ++k) Step();
  EXPECT_EQ(Values().num_jerk_samples, 0);
  Step();
  EXPECT_EQ(Values().num_jerk_samples, 1);
  EXPECT_EQ(Values().avg_cartesian_jerk_mps3[0], 0);
  EXPECT_EQ(Values().cartesian_path_length_m[0], 5);
  EXPECT_EQ(Extended("peak_wrist_speed_mps.left"), 0);
}

TEST_F(RolloutMetricsTest, ComparesSpeedsAndHeightsOfTheArms) {
  Start();
  sample_.w = {{3, 4}, {0, -2}};
  sample_.p[0][2] = 1;
  sample_.p[1][2] = 1.5;
  Step();
  sample_.w = {{0, 0}, {0, 1}};
  sample_.p[1][2] = 1;
  Step();
  EXPECT_DOUBLE_EQ(Values().bimanual_arm_velocity_difference_radps, (3 + 1) / 2.);
  EXPECT_DOUBLE_EQ(Values().bimanual_gripper_vertical_difference_m, 0.25);
}

TEST_F(RolloutMetricsTest, CountsASlipOnlyWithoutOpening) {
  SetHolding(0, 0, true);
  SetHolding(0, 1, true);
  SetHolding(1, 1, true);
  Start();
  SetHolding(0, 0, false);  // the opening is unchanged, so this is a slip
  SetHolding(0, 1, false);  // the gripper has opened, so it releases both objects
  SetHolding(1, 1, false);
  sample_.opening[1] = 0.51;
  Step();
  EXPECT_EQ(Values().slip_count, 1);
  EXPECT_EQ(Values().slip_count_per_object, (std::vector<int64_t>{1, 0}));
  Step();
  EXPECT_EQ(Values().slip_count, 1);
  SetHolding(1, 1, true);
  Step();
  SetHolding(1, 1, false);
  sample_.opening[1] = 0.4;  // closes further while the object slips
  Step();
  EXPECT_EQ(Values().slip_count_per_object, (std::vector<int64_t>{1, 1}));
}

TEST_F(RolloutMetricsTest, SlipWindowUsesEveryThirdSample) {
  MetricsConfig config = TwoArms();
  config.slip_sample_window = 3;
  dut_ = RolloutMetrics(config);
  Start();
  SetHolding(0, 0, true);
  Step();  // held in sample 0
  SetHolding(0, 0, false);
  Step();
  SetHolding(0, 0, true);
  Step();
  Step();  // held in sample 3
  SetHolding(0, 0, false);
  Step();
  EXPECT_EQ(Values().slip_count, 0);
  Step();
  Step();  // sample 6
  EXPECT_EQ(Values().slip_count, 1);
}

TEST_F(RolloutMetricsTest, CountsNewContactsOnly) {
  Start();
  sample_.contacts = {{2, 1, -0.001}, {3, 1, 0},  {1, 4, 2e-8}, {2, 5, -0.001},
                      {4, 3, -1},     {3, 4, -1}, {-1, 2, -1},  {2, 6, -1}};
  Step();
  EXPECT_EQ(Values().env_collision_count, 1);   // the table counts once
  EXPECT_EQ(Values().self_collision_count, 1);  // the pair of 3 and 4 counts once
  sample_.contacts = {{4, 1, 1e-8}, {0, 2, 0}, {2, 3, 0}, {4, 3, 0}};
  Step();
  EXPECT_EQ(Values().env_collision_count, 2);   // the floor; the table was already touched
  EXPECT_EQ(Values().self_collision_count, 2);  // the pair of 2 and 3
  sample_.contacts = {};
  Step();
  sample_.contacts = {{1, 2, 0}};
  Step();
  EXPECT_EQ(Values().env_collision_count, 3);
  EXPECT_EQ(Extended("contact_time_s"), 1.5);
}

TEST_F(RolloutMetricsTest, CollisionWindowUsesEveryThirdSample) {
  MetricsConfig config = TwoArms();
  config.collision_sample_window = 3;
  dut_ = RolloutMetrics(config);
  Start();
  Step();
  sample_.contacts = {{1, 2, 0}};
  Step();
  Step();
  EXPECT_EQ(Values().env_collision_count, 0);
  Step();
  EXPECT_EQ(Values().env_collision_count, 1);
}

TEST_F(RolloutMetricsTest, StagesCanBeWithdrawnAndGapsCountAsNotReached) {
  Start();
  EXPECT_EQ(Values().subtask_progress, 0);
  Step();
  dut_.SetStage(2, true);
  EXPECT_EQ(Values().subtask_progress, 0.5);
  Step();
  dut_.SetStage(2, false);
  dut_.SetStage(4, true);
  EXPECT_EQ(Values().stage_index, (std::vector<int32_t>{1, 2, 4}));
  EXPECT_EQ(Values().stage_name, (std::vector<std::string>{"grasp", "lift", ""}));
  EXPECT_EQ(Values().stage_reached, (std::vector<int8_t>{0, 0, 1}));
  EXPECT_EQ(Values().subtask_progress, 0.25);
  std::vector<double> times;
  for (const StageState& stage : dut_.stages().stages()) times.push_back(stage.reached_time);
  EXPECT_EQ(times, (std::vector<double>{-1, 0.5, 1}));
}

TEST_F(RolloutMetricsTest, MeasuresEffortAndSafety) {
  Start();
  EXPECT_TRUE(std::isnan(Extended("min_clearance_m")));
  EXPECT_TRUE(std::isnan(Extended("min_joint_limit_margin_rad")));
  sample_.work[1] = 0.5;
  sample_.q[0] = {0.25, -0.5};
  sample_.clearance = 0.2;
  sample_.contacts = {
      {5, 1, -0.5}, {2, 5, -0.01}, {4, 1, 0}};  // contacts of the pot with the table do not involve the robot
  Step();
  sample_.p[0] = {3, 4, 0};
  sample_.work[1] = 2;
  sample_.clearance = 0.1;
  Step();
  sample_.clearance = 0.1;
  Step();

  EXPECT_EQ(Extended("min_clearance_m"), 0.1);
  EXPECT_EQ(Extended("min_clearance_time_s"), 1);
  EXPECT_EQ(Extended("peak_penetration_m"), 0.01);
  EXPECT_EQ(Extended("mechanical_work_J.left"), 0);
  EXPECT_EQ(Extended("mechanical_work_J.right"), 2);
  EXPECT_EQ(Extended("peak_wrist_speed_mps.left"), 10);
  EXPECT_EQ(Extended("peak_wrist_speed_mps.right"), 0);
  EXPECT_EQ(Extended("min_joint_limit_margin_rad"), 0.5);
}

TEST_F(RolloutMetricsTest, RefusesWhatIsNotFinite) {
  Start();
  Step();
  const std::string before = ResultJson(Values()).dump();
  const TestSample good = sample_;
  const double kInf = std::numeric_limits<double>::infinity();
  int refused = 0;
  const auto expect_refused = [&](const char* what) {
    EXPECT_FALSE(dut_.Step(sample_.At(2))) << what;
    EXPECT_EQ(dut_.refused_samples(), ++refused) << what;
    sample_ = good;
  };
  sample_.q[1][1] = kNaN;
  expect_refused("joint position");
  sample_.w[0][0] = -kInf;
  expect_refused("joint velocity");
  sample_.work[0] = kNaN;
  expect_refused("work");
  sample_.p[1][2] = kInf;
  expect_refused("wrist position");
  sample_.quat[1][3] = kNaN;
  expect_refused("wrist quaternion");
  sample_.quat[0] = {0, 0, 0, 0};
  expect_refused("zero quaternion");
  sample_.opening[1] = kNaN;
  expect_refused("opening");
  sample_.contacts = {{2, 1, kNaN}};
  expect_refused("contact distance");
  sample_.clearance = kNaN;
  expect_refused("clearance");
  sample_.q[0].pop_back();
  expect_refused("size");
  sample_.arm.pop_back();
  expect_refused("number of arms");
  sample_.opening.push_back(0);
  expect_refused("number of grippers");
  sample_.holding.pop_back();
  sample_.pinched.pop_back();
  expect_refused("number of pairs");
  sample_.pinched.pop_back();
  expect_refused("number of pinched pairs");

  EXPECT_EQ(ResultJson(Values()).dump(), before);
  EXPECT_EQ(dut_.refused_samples(), refused);
  EXPECT_TRUE(dut_.Step(sample_.At(2)));
}

// Plays an episode with every kind of event.
void Stir(RolloutMetrics* metrics) {
  TestSample sample;
  sample.holding = {1, 0, 0, 1};
  metrics->Start(sample.opening, sample.holding);
  for (int tick = 1; tick <= 20; ++tick) {
    for (int arm = 0; arm < 2; ++arm) {
      sample.q[arm] = {std::sin(tick + arm), 0.1 * tick};
      sample.w[arm] = {std::cos(tick + arm), 0.2};
      sample.work[arm] = 0.5 * tick;
      sample.p[arm] = {std::sin(2. * tick), 0.3, std::cos(3. * tick + arm)};
      sample.quat[arm] = {std::cos(tick), std::sin(tick), 0, 0};
    }
    sample.holding[0] = tick % 3 == 0;
    sample.holding[3] = tick % 4 == 0;
    sample.contacts.assign(tick % 2 ? 3 : 0, {1, 2, -0.001 * tick});
    sample.clearance = 0.01 * tick;
    if (tick % 2) sample.contacts[1] = {3, 4, -1};
    metrics->Step(sample.At(tick));
    metrics->SetStage(1 + tick % 2, true);
    metrics->SetTargetDistance(0, tick);
    metrics->SetPoseError(0, tick);
    metrics->SetSuccess(tick > 10);
  }
}

TEST_F(RolloutMetricsTest, NothingSurvivesStart) {
  Stir(&dut_);
  const std::string first = ResultJson(Values()).dump() + ExtendedJson(Extended(), Values()).dump();
  // Every count and value of that episode differs from zero, except the distance to the goal.
  for (const auto& [name, value] : FlattenedValues(ResultJson(Values()))) {
    if (name == "target_distance.goal") continue;
    EXPECT_NE(value, 0) << name;
  }
  sample_.p[0][0] = kNaN;
  Step();
  sample_ = {};

  // After it, an episode without events gives the same values as with a new object.
  RolloutMetrics fresh(TwoArms());
  dut_.Start(sample_.opening, sample_.holding);
  fresh.Start(sample_.opening, sample_.holding);
  metric_values_t fresh_values{};
  for (int tick = 1; tick < 10; ++tick) {
    fresh.Values(&fresh_values);
    const extended_metrics_t fresh_extended = ExtendedOf(fresh);
    EXPECT_EQ(ResultJson(Values()).dump(), ResultJson(fresh_values).dump());
    EXPECT_EQ(ExtendedJson(Extended(), Values()).dump(), ExtendedJson(fresh_extended, fresh_values).dump());
    ASSERT_TRUE(dut_.Step(sample_.At(tick)));
    ASSERT_TRUE(fresh.Step(sample_.At(tick)));
  }
  EXPECT_EQ(Values().avg_cartesian_jerk_mps3[0], 0);

  Stir(&dut_);
  EXPECT_EQ(ResultJson(Values()).dump() + ExtendedJson(Extended(), Values()).dump(), first);
}

TEST_F(RolloutMetricsTest, DoesNotAllocateAfterTheFirstEpisode) {
  Stir(&dut_);
  metric_values_t values{};
  std::vector<double> extended;
  dut_.Values(&values);
  dut_.extended().Values(&extended);
  sample_.contacts.assign(40, {1, 2, -0.001});
  sample_.contacts[3] = {2, 3, -0.001};
  sample_.holding = {1, 0, 1, 0};

  const int64_t before = AllocationCount();
  dut_.Start(sample_.opening, sample_.holding);
  for (int tick = 1; tick < 50; ++tick) {
    sample_.holding[0] = tick % 2;
    dut_.Step(sample_.At(tick));
    dut_.SetStage(1, true);
    dut_.Values(&values);
    dut_.extended().Values(&extended);
  }
  EXPECT_EQ(AllocationCount() - before, 0);
  EXPECT_GT(values.slip_count, 0);
}

// Each option disables only the metrics that it names.
TEST_F(RolloutMetricsTest, WhatIsNotTrackedStaysZero) {
  Stir(&dut_);
  const auto all = FlattenedValues(ResultJson(Values()));
  for (const TrackOption& option : TrackOptions()) {
    MetricsConfig config = TwoArms();
    config.untracked = {option.member};
    RolloutMetrics metrics(config);
    Stir(&metrics);
    metric_values_t values{};
    metrics.Values(&values);
    EXPECT_EQ(values.*option.member, 0) << option.key;
    std::map<std::string_view, double> left;
    for (const auto& [name, value] : FlattenedValues(ResultJson(values))) left[name] = value;
    for (const auto& [name, value] : all) {
      if (FindMetric(std::string(name)).metric->track != &option) {
        ASSERT_TRUE(left.contains(name)) << option.key << " " << name;
        EXPECT_EQ(left[name], value) << option.key << " " << name;
      } else if (option.key == "track_slippage") {
        EXPECT_EQ(left.at(name), 0) << name;
      } else {
        EXPECT_FALSE(left.contains(name)) << option.key << " " << name;
      }
    }
  }
}

TEST_F(RolloutMetricsTest, RefusesASenselessConfig) {
  for (double dt : {0., -1., kNaN}) {
    MetricsConfig config = TwoArms();
    config.control_dt = dt;
    EXPECT_THROW(RolloutMetrics{config}, std::invalid_argument);
  }
  MetricsConfig config = TwoArms();
  config.slip_sample_window = 0;
  EXPECT_THROW(RolloutMetrics{config}, std::invalid_argument);
}

}  // namespace evalbus::metrics::rollout_metrics_test
