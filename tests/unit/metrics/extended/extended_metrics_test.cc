// Tests the extended metrics through the list that contains them all. Expected values are worked out by hand,
// closed forms, and properties that the papers state.
#include "metrics/extended/extended_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "metrics/extended/spectral_arc_length.h"

namespace evalbus::metrics::extended_metrics_test {

constexpr double kPi = std::numbers::pi;

// Geoms 0 and 1 are the scene, 2 to 4 the robot, and 5 the pot.
MetricsConfig Config(double dt) {
  MetricsConfig config;
  config.arms = {{.name = "left", .num_joints = 1, .joint_lower = {-1}, .joint_upper = {2}}};
  config.grippers = {"left", "right"};
  config.objects = {"pot", "lid"};
  config.geom_owner = {GeomOwner::kScene, GeomOwner::kScene, GeomOwner::kRobot,
                       GeomOwner::kRobot, GeomOwner::kRobot, GeomOwner::kObject};
  config.control_dt = dt;
  return config;
}

// An episode of one arm. Everything that a test does not set is at rest.
class Episode {
 public:
  explicit Episode(double dt) : dt_(dt), deriver_(Config(dt)), dut_(Config(dt)) { dut_.Start(); }

  std::array<double, 3> p{0, 0, 0};
  double q = 0;
  std::optional<double> work;
  std::vector<double> command;
  std::vector<GeomContact> contacts;
  std::vector<uint8_t> pinched{0, 0, 0, 0};
  std::vector<uint8_t> holding{0, 0, 0, 0};

  void Step(int64_t ticks = 1) {
    tick_ += ticks;
    const std::vector<double> joint = {q}, zero = {0}, opening = {1, 1};
    const std::vector<ArmSample> arm = {{joint, zero, p, {1, 0, 0, 0}, work, {}, command}};
    const Sample sample{.tick = tick_,
                        .time = static_cast<double>(tick_) * dt_,
                        .arm = arm,
                        .gripper_opening = opening,
                        .holding = holding,
                        .pinched = pinched,
                        .contacts = contacts,
                        .clearance = {}};
    dut_.Add(deriver_.Derive(sample));
  }
  void Steps(int count) {
    for (int k = 0; k < count; ++k) Step();
  }
  // Returns the value of an episode that ends this many ticks after its last sample.
  double Final(const std::string& name, int64_t missing = 0) const {
    std::vector<double> values;
    dut_.FinalValues(tick_ + missing, &values);
    return Find(name, values);
  }
  double Live(const std::string& name) const {
    std::vector<double> values;
    dut_.Values(&values);
    return Find(name, values);
  }

 private:
  double Find(const std::string& name, const std::vector<double>& values) const {
    return values.at(std::ranges::find(dut_.names(), name) - dut_.names().begin());
  }

  double dt_;
  SampleDeriver deriver_;
  ExtendedMetrics dut_;
  int64_t tick_ = 0;
};

TEST(ExtendedMetrics, AreSortedByNameWithTheCatalogsUnits) {
  const ExtendedMetrics dut(Config(0.02));
  EXPECT_EQ(dut.names(), (std::vector<std::string>{"command_log_dimensionless_jerk",
                                                   "contact_time_s",
                                                   "env_collision_events",
                                                   "self_collision_events",
                                                   "first_touch_s",
                                                   "grasp_count.left",
                                                   "grasp_count.right",
                                                   "grasp_time_s.left",
                                                   "grasp_time_s.right",
                                                   "longest_grasp_s.left",
                                                   "longest_grasp_s.right",
                                                   "regrasp_count.left",
                                                   "regrasp_count.right",
                                                   "grip_force_mean_N.left",
                                                   "grip_force_mean_N.right",
                                                   "grip_force_peak_N.left",
                                                   "grip_force_peak_N.right",
                                                   "idle_time_s",
                                                   "log_dimensionless_jerk",
                                                   "mechanical_work_J",
                                                   "min_clearance_m",
                                                   "min_clearance_time_s",
                                                   "min_joint_limit_margin_rad",
                                                   "min_joint_torque_margin",
                                                   "p95_object_force_N",
                                                   "p95_scene_force_N",
                                                   "p95_self_force_N",
                                                   "peak_object_force_N",
                                                   "peak_scene_force_N",
                                                   "peak_self_force_N",
                                                   "peak_penetration_m",
                                                   "peak_touch_energy_J",
                                                   "unwanted_impulse_Ns",
                                                   "peak_wrist_acceleration_mps2",
                                                   "peak_wrist_speed_mps",
                                                   "spectral_arc_length",
                                                   "tracking_error_rad"}));
  EXPECT_EQ(dut.units(),
            (std::vector<std::string>{"1", "s",     "count", "count", "s",   "count", "count", "s", "s", "s",
                                      "s", "count", "count", "N",     "N",   "N",     "N",     "s", "1", "J",
                                      "m", "s",     "rad",   "1",     "N",   "N",     "N",     "N", "N", "N",
                                      "m", "J",     "N s",   "m/s²",  "m/s", "1",     "rad"}));
}

TEST(CollisionEvents, APairCountsAgainAfterATenthOfASecondApart) {
  Episode episode(0.02);
  const std::vector<GeomContact> touching = {{2, 0, -0.001}, {0, 2, 0}, {3, 4, 0}, {2, 5, 0}, {1, 5, 0}};
  episode.contacts = touching;
  episode.Step();
  EXPECT_EQ(episode.Live("env_collision_events"), 1);  // counted once; the pot is not in the scene
  EXPECT_EQ(episode.Live("self_collision_events"), 1);
  episode.contacts = {};
  episode.Steps(4);  // separated by 0.08 s
  episode.contacts = touching;
  episode.Step();
  EXPECT_EQ(episode.Live("env_collision_events"), 1);
  episode.contacts = {};
  episode.Steps(5);  // separated by 0.1 s
  episode.contacts = touching;
  episode.Step();
  EXPECT_EQ(episode.Live("env_collision_events"), 2);
  EXPECT_EQ(episode.Live("self_collision_events"), 2);
  episode.contacts = {{3, 0, 0}};  // another pair
  episode.Step();
  EXPECT_EQ(episode.Live("env_collision_events"), 3);
  EXPECT_NEAR(episode.Live("contact_time_s"), 4 * 0.02, 1e-12);
}

TEST(Grasps, EndAfterATenthOfASecondWithoutBothPads) {
  Episode episode(0.05);
  episode.pinched = {0, 1, 0, 0};  // the right gripper holds the pot
  episode.Steps(2);
  episode.pinched = {};
  episode.pinched.resize(4);
  episode.Step();                  // an interruption of 0.05 s is too short to count
  episode.pinched = {0, 1, 1, 0};  // in addition, the left gripper holds the lid
  episode.Steps(3);
  EXPECT_EQ(episode.Live("grasp_count.right"), 1);
  EXPECT_NEAR(episode.Live("longest_grasp_s.right"), 6 * 0.05, 1e-12);
  episode.pinched = {0, 0, 1, 0};
  episode.Steps(2);  // after 0.1 s the grasp has ended
  episode.pinched = {0, 1, 0, 0};
  episode.Step();
  EXPECT_EQ(episode.Live("grasp_count.right"), 2);
  EXPECT_NEAR(episode.Live("grasp_time_s.right"), 7 * 0.05, 1e-12);
  EXPECT_NEAR(episode.Live("longest_grasp_s.right"), 6 * 0.05, 1e-12);
  EXPECT_EQ(episode.Live("regrasp_count.right"), 1);
  EXPECT_EQ(episode.Live("regrasp_count.left"), 0);
  EXPECT_EQ(episode.Live("grasp_count.left"), 1);
  EXPECT_NEAR(episode.Live("grasp_time_s.left"), 5 * 0.05, 1e-12);
}

TEST(Grasps, OfAnotherObjectIsNoRegrasp) {
  Episode episode(0.05);
  episode.pinched = {1, 0, 0, 0};  // the left gripper holds the pot
  episode.Step();
  episode.pinched = {0, 0, 1, 0};  // the left gripper holds the lid
  episode.Steps(2);
  EXPECT_EQ(episode.Live("grasp_count.left"), 2);
  EXPECT_EQ(episode.Live("regrasp_count.left"), 0);
  episode.pinched = {1, 0, 0, 0};
  episode.Step();
  EXPECT_EQ(episode.Live("regrasp_count.left"), 1);
}

TEST(FirstTouch, IsTheFirstSampleInWhichAPadTouchesAnObject) {
  Episode episode(0.02);
  episode.Steps(2);
  EXPECT_TRUE(std::isnan(episode.Live("first_touch_s")));
  episode.holding = {0, 0, 0, 1};
  episode.Steps(2);
  EXPECT_NEAR(episode.Live("first_touch_s"), 0.06, 1e-12);
}

TEST(PeakWristAcceleration, IsTheSecondDifferenceOfThreeInARow) {
  Episode episode(0.1);
  episode.p = {5, 0, 0};
  episode.Step();
  episode.p = {5, 0, 0};
  episode.Step();
  EXPECT_EQ(episode.Live("peak_wrist_acceleration_mps2"), 0);
  episode.p = {5.03, 0.04, 0};
  episode.Step();
  EXPECT_NEAR(episode.Live("peak_wrist_acceleration_mps2"), 5, 1e-9);
  EXPECT_NEAR(episode.Live("peak_wrist_speed_mps"), 0.5, 1e-9);
  episode.p = {7, 0, 0};
  episode.Step(2);  // a tick is missing: no speed and no acceleration
  episode.Step();
  EXPECT_NEAR(episode.Live("peak_wrist_speed_mps"), 0.5, 1e-9);
  EXPECT_NEAR(episode.Live("peak_wrist_acceleration_mps2"), 5, 1e-9);
}

// Moves the wrist along a line with a speed of `velocity` (m/s) at s = t / T from 0 to 1.
Episode Along(const std::function<double(double)>& velocity, double duration, double dt) {
  Episode episode(dt);
  episode.Step();
  const int steps = static_cast<int>(std::lround(duration / dt));
  for (int k = 0; k < steps; ++k) {
    episode.p[0] += velocity((k + 0.5) / steps) * dt;
    episode.Step();
  }
  return episode;
}

// Returns the speed of a reach of 1 m in 1 s.
double MinimumJerk(double s) { return 30 * s * s * (1 - s) * (1 - s); }

TEST(MechanicalWork, IsTheLastThatIsKnown) {
  Episode episode(0.02);
  EXPECT_TRUE(std::isnan(episode.Live("mechanical_work_J")));
  episode.Step();
  EXPECT_TRUE(std::isnan(episode.Live("mechanical_work_J")));
  episode.work = 1.5;
  episode.Step();
  episode.work = 2.25;
  episode.Step(7);  // includes the work during the missing ticks
  EXPECT_EQ(episode.Final("mechanical_work_J"), 2.25);
}

// A multiplication gives 0.02 * 230 = 4.6000000000000005, and repeated addition of 0.02 gives neither this
// nor 4.6.
TEST(Times, AreTheNumbersOfTheirTicks) {
  Episode episode(0.02);
  episode.contacts = {{2, 0, -0.001}};
  episode.pinched = {0, 1, 0, 0};
  episode.Steps(115);
  episode.pinched = {0, 0, 0, 0};
  episode.contacts = {};
  episode.Steps(5);
  episode.contacts = {{2, 0, -0.001}};
  episode.pinched = {0, 1, 0, 0};
  episode.Steps(115);
  EXPECT_EQ(episode.Final("contact_time_s"), 4.6);
  EXPECT_EQ(episode.Final("grasp_time_s.right"), 4.6);
  EXPECT_EQ(episode.Final("longest_grasp_s.right"), 2.3);
}

TEST(LogDimensionlessJerk, OfAMinimumJerkReach) {
  // v = 30 (s^2 - 2 s^3 + s^4) has v'' = 60 (1 - 6 s + 6 s^2). The integral of its square over 0 to 1 is 720,
  // and the peak of v is 15/8, so the result is -ln(720 / (15/8)^2).
  EXPECT_NEAR(Along(MinimumJerk, 1, 0.0005).Live("log_dimensionless_jerk"), -std::log(204.8), 0.01);
}

TEST(LogDimensionlessJerk, OfAHalfSine) {
  // For v = sin(pi s), the integral of (pi^2 sin)^2 is pi^4 / 2.
  const auto sine = [](double s) { return std::sin(kPi * s); };
  EXPECT_NEAR(Along(sine, 2, 0.001).Live("log_dimensionless_jerk"), -std::log(std::pow(kPi, 4) / 2), 0.01);
}

TEST(CommandJerk, IsThatOfTheCommandsOnly) {
  Episode episode(0.002);
  for (int k = 0; k <= 500; ++k) {
    const double s = k / 500.0;
    episode.command = {-2 * (10 - 15 * s + 6 * s * s) * s * s * s};  // a reach of -2 rad
    episode.p[0] = k % 3 == 0;
    episode.Step();
  }
  EXPECT_NEAR(episode.Final("command_log_dimensionless_jerk"), -std::log(204.8), 0.03);
  EXPECT_LT(episode.Final("log_dimensionless_jerk"), -15);
  EXPECT_TRUE(std::isnan(episode.Final("command_log_dimensionless_jerk", 1))) << "the last tick is missing";
}

TEST(CommandJerk, NeedsCommands) {
  EXPECT_TRUE(std::isnan(Along(MinimumJerk, 1, 0.002).Final("command_log_dimensionless_jerk")));
}

TEST(Smoothness, DependsNeitherOnAmplitudeNorOnDuration) {
  for (const char* metric : {"log_dimensionless_jerk", "spectral_arc_length"}) {
    const double one = Along(MinimumJerk, 1, 0.001).Final(metric);
    const auto large = [](double s) { return 7 * MinimumJerk(s); };
    EXPECT_NEAR(Along(large, 1, 0.001).Final(metric), one, 1e-9) << metric;
    EXPECT_NEAR(Along(MinimumJerk, 2, 0.001).Final(metric), one, 0.02) << metric;
    EXPECT_NEAR(Along(MinimumJerk, 0.7, 0.001).Final(metric), one, 0.02) << metric;
  }
}

TEST(Smoothness, FallsWithTheNumberOfSubmovements) {
  const auto reaches = [](int count) {
    return [count](double s) { return MinimumJerk(s * count - std::floor(s * count)); };
  };
  for (const char* metric : {"log_dimensionless_jerk", "spectral_arc_length"}) {
    double last = 0;
    for (const int count : {1, 2, 3, 5}) {
      const double value = Along(reaches(count), 3, 0.005).Final(metric);
      EXPECT_LT(value, last - 0.1) << metric << " of " << count;
      last = value;
    }
  }
}

// Follows the paper's procedure with a plain discrete Fourier transform.
double SlowSpectralArcLength(const std::vector<double>& v, double dt) {
  const size_t size = size_t{1} << static_cast<int>(std::ceil(std::log2(v.size())) + 4);
  std::vector<double> f, magnitude;
  for (size_t k = 0; k < size && k / (size * dt) <= 10; ++k) {
    std::complex<double> sum = 0;
    for (size_t i = 0; i < v.size(); ++i)
      sum += v[i] * std::polar(1.0, -2 * kPi * static_cast<double>(k * i) / size);
    f.push_back(k / (size * dt));
    magnitude.push_back(std::abs(sum));
  }
  // A speed is never negative, so its spectrum is largest at 0.
  const double largest = magnitude[0];
  size_t last = 0;
  for (size_t k = 0; k < f.size(); ++k) {
    magnitude[k] /= largest;
    if (magnitude[k] >= 0.05) last = k;
  }
  double length = 0;
  for (size_t k = 1; k <= last; ++k) {
    length += std::hypot((f[k] - f[k - 1]) / (f[last] - f[0]), magnitude[k] - magnitude[k - 1]);
  }
  return -length;
}

TEST(SpectralArcLength, EqualsTheProcedureStepByStep) {
  for (const int size : {2, 3, 17, 64, 90}) {
    for (const double dt : {0.05, 0.02, 0.004}) {
      std::vector<double> v;
      for (int i = 0; i < size; ++i) v.push_back(1 + std::sin(0.3 * i) + 0.5 * std::cos(1.7 * i));
      EXPECT_NEAR(SpectralArcLength(v, dt), SlowSpectralArcLength(v, dt), 1e-9) << size << " " << dt;
    }
  }
}

TEST(SpectralArcLength, OfAMinimumJerkReachIsKnown) {
  // Another program, which follows the paper's procedure with a plain discrete Fourier transform, computed
  // these values.
  EXPECT_NEAR(Along(MinimumJerk, 1, 0.01).Final("spectral_arc_length"), -1.4058, 1e-4);
}

TEST(Smoothness, HasNoValueWhereThereIsNone) {
  for (const char* metric : {"log_dimensionless_jerk", "spectral_arc_length"}) {
    Episode still(0.02);
    EXPECT_TRUE(std::isnan(still.Final(metric))) << "empty";
    still.Steps(50);
    EXPECT_TRUE(std::isnan(still.Final(metric))) << "without movement";
    Episode hole(0.02);
    for (int k = 0; k < 50; ++k) {
      hole.p[0] = std::sin(0.1 * k);
      hole.Step(k == 30 ? 2 : 1);
    }
    EXPECT_TRUE(std::isnan(hole.Final(metric))) << "with a hole";
    Episode late(0.02);
    for (int k = 0; k < 50; ++k) {
      late.p[0] = std::sin(0.1 * k);
      late.Step(k == 0 ? 2 : 1);
    }
    EXPECT_TRUE(std::isnan(late.Final(metric))) << "without the first tick";
    EXPECT_TRUE(std::isnan(late.Live(metric))) << "without the first tick";
    const Episode cut = Along(MinimumJerk, 1, 0.02);
    EXPECT_FALSE(std::isnan(cut.Final(metric)));
    EXPECT_TRUE(std::isnan(cut.Final(metric, 1))) << "without the last tick";
  }
  const Episode reach = Along(MinimumJerk, 1, 0.02);
  EXPECT_TRUE(std::isnan(reach.Live("spectral_arc_length"))) << "only at the end";
  EXPECT_FALSE(std::isnan(reach.Final("spectral_arc_length")));
}

}  // namespace evalbus::metrics::extended_metrics_test
