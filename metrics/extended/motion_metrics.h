// Metrics of the arms' motion and of their servos. Defined by evalbus (docs/metrics.md). Source of the
// dimensionless jerk: Balasubramanian, Melendez-Calderon, Burdet: A robust and sensitive metric for
// quantifying movement smoothness, IEEE Trans. Biomed. Eng. 59(8), 2012.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "lcmtypes/clock.h"
#include "metrics/extended/extended_metric.h"

namespace evalbus::metrics {

// Base class of metrics with one value per arm: -ln(T^3 / v_peak^2 . integral of (d^2 v / dt^2)^2 dt) of the
// speeds v_1 to v_M of consecutive samples, with T = M dt and second differences for the derivative. Values
// nearer to 0 are smoother. The value depends on the shape of the profile only, not on its length or speed.
// There is no value for fewer than three speeds, without movement, at constant speed, or if any sample of the
// episode is missing, including the first or the last.
class SpeedJerk : public ExtendedMetric {
 public:
  explicit SpeedJerk(const MetricsConfig& config) : arms_(config.arms.size()) {}

  void Start() override {
    arms_.assign(arms_.size(), {});
    samples_ = last_tick_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    last_tick_ = derived.sample.tick;
    ++samples_;
    for (size_t k = 0; k < arms_.size(); ++k) {
      const double v = Speed(derived, k);
      if (samples_ == 1) continue;
      Arm& arm = arms_[k];
      if (samples_ >= 4) {
        const double difference = v - 2 * arm.v1 + arm.v2;
        arm.sum_of_squares += difference * difference;
      }
      arm.peak = std::max(arm.peak, v);
      arm.v2 = arm.v1;
      arm.v1 = v;
    }
  }
  void Values(std::span<double> values) const override { FinalValues(last_tick_, values); }
  void FinalValues(int64_t last_tick, std::span<double> values) const override {
    for (size_t k = 0; k < arms_.size(); ++k) {
      const Arm& arm = arms_[k];
      // T^3 = M^3 dt^3, the squared derivative contributes dt^-4 and the integral dt, and speeds are
      // proportional to dt^-1, so dt cancels out.
      const double count = static_cast<double>(samples_ - 1);
      const double jerk = count * count * count * arm.sum_of_squares / (arm.peak * arm.peak);
      const bool exists = samples_ == last_tick && jerk > 0 && std::isfinite(jerk);
      values[k] = exists ? -std::log(jerk) : kNone;
    }
  }

 protected:
  // Returns the speed between the previous sample and this one, in any unit; NaN if it is unknown. The result
  // for the first sample is not used.
  virtual double Speed(const DerivedSample& derived, size_t arm) = 0;

 private:
  struct Arm {
    double v1 = 0, v2 = 0;  // v_(i-1), v_(i-2)
    double peak = 0;
    double sum_of_squares = 0;
  };
  std::vector<Arm> arms_;
  int64_t samples_ = 0;
  int64_t last_tick_ = 0;
};

// Smoothness of the robot's movement: dimensionless jerk of the wrist's speed, norm(p_i - p_(i-1)) / dt.
class LogDimensionlessJerk : public SpeedJerk {
 public:
  static constexpr const char* kNames[] = {"log_dimensionless_jerk"};
  using SpeedJerk::SpeedJerk;

 private:
  double Speed(const DerivedSample& derived, size_t arm) override { return derived.wrist_speed[arm]; }
};

// Smoothness of the policy's commands: dimensionless jerk of the speed at which each arm's joint commands
// change, norm(c_i - c_(i-1)) over its joints. There is no value if the source does not provide commands.
class CommandJerk : public SpeedJerk {
 public:
  static constexpr const char* kNames[] = {"command_log_dimensionless_jerk"};
  explicit CommandJerk(const MetricsConfig& config) : SpeedJerk(config) {
    for (const ArmConfig& arm : config.arms) previous_.emplace_back(arm.num_joints);
  }

 private:
  double Speed(const DerivedSample& derived, size_t arm) override {
    const std::span<const double> command = derived.sample.arm[arm].joint_command;
    std::vector<double>& previous = previous_[arm];
    if (command.size() != previous.size()) return kNone;
    double squares = 0;
    for (size_t j = 0; j < command.size(); ++j) {
      const double difference = command[j] - previous[j];
      squares += difference * difference;
      previous[j] = command[j];
    }
    return std::sqrt(squares);
  }

  std::vector<std::vector<double>> previous_;  // rad, by arm and joint
};

// Largest norm(p_i - p_(i-1)) / dt over consecutive samples, m/s; 0 if there are none.
class PeakWristSpeed : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_wrist_speed_mps"};
  explicit PeakWristSpeed(const MetricsConfig& config) : peak_(config.arms.size()) {}

  void Start() override { peak_.assign(peak_.size(), 0); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < peak_.size(); ++k) peak_[k] = std::max(peak_[k], derived.wrist_speed[k]);
  }
  void Values(std::span<double> values) const override {
    std::copy(peak_.begin(), peak_.end(), values.begin());
  }

 private:
  std::vector<double> peak_;
};

// Largest norm(p_i - 2 p_(i-1) + p_(i-2)) / dt^2 over three consecutive samples, m/s^2; 0 if there are none.
class PeakWristAcceleration : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"peak_wrist_acceleration_mps2"};
  explicit PeakWristAcceleration(const MetricsConfig& config)
      : dt_(config.control_dt), arms_(config.arms.size()) {}

  void Start() override {
    arms_.assign(arms_.size(), {});
    filled_ = 0;
  }
  void Add(const DerivedSample& derived) override {
    if (!derived.in_a_row) filled_ = 0;
    for (size_t k = 0; k < arms_.size(); ++k) {
      Arm& arm = arms_[k];
      const std::array<double, 3>& p = derived.sample.arm[k].wrist_position;
      if (filled_ == 2) {
        double sum = 0;
        for (int i = 0; i < 3; ++i) {
          const double difference = p[i] - 2 * arm.p1[i] + arm.p2[i];
          sum += difference * difference;
        }
        arm.peak = std::max(arm.peak, std::sqrt(sum) / (dt_ * dt_));
      }
      arm.p2 = arm.p1;
      arm.p1 = p;
    }
    filled_ = std::min(filled_ + 1, 2);
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < arms_.size(); ++k) values[k] = arms_[k].peak;
  }

 private:
  struct Arm {
    std::array<double, 3> p1{}, p2{};  // p_(i-1), p_(i-2)
    double peak = 0;
  };
  double dt_;
  std::vector<Arm> arms_;
  // Number of positions among p1 and p2 that are from the consecutive samples just before the next one.
  int filled_ = 0;
};

// An arm is idle while all of its joints are slower than this (rad/s).
inline constexpr double kIdleJointSpeed = 0.01;

// Computes for each arm the sum of dt over all samples in which it is idle (s).
class IdleTime : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"idle_time_s"};
  explicit IdleTime(const MetricsConfig& config) : dt_(config.control_dt), samples_(config.arms.size()) {}

  void Start() override { samples_.assign(samples_.size(), 0); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < samples_.size(); ++k) {
      const std::span<const double> velocity = derived.sample.arm[k].joint_velocity;
      samples_[k] += std::all_of(velocity.begin(), velocity.end(),
                                 [](double v) { return std::abs(v) < kIdleJointSpeed; });
    }
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < samples_.size(); ++k) values[k] = TickTime(samples_[k], dt_);
  }

 private:
  double dt_;
  std::vector<int64_t> samples_;
};

// Computes for each arm the root mean square, over samples and joints, of the commanded position minus the
// measured position at the end of the tick (rad). There is no value if the source does not provide commands.
class TrackingError : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"tracking_error_rad"};
  explicit TrackingError(const MetricsConfig& config) : sums_(config.arms.size()) {}

  void Start() override { sums_.assign(sums_.size(), {}); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < sums_.size(); ++k) {
      const ArmSample& arm = derived.sample.arm[k];
      for (size_t j = 0; j < arm.joint_command.size(); ++j) {
        const double error = arm.joint_command[j] - arm.joint_position[j];
        sums_[k].squares += error * error;
        ++sums_[k].count;
      }
    }
  }
  void Values(std::span<double> values) const override {
    for (size_t k = 0; k < sums_.size(); ++k) {
      const auto& [squares, count] = sums_[k];
      values[k] = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : kNone;
    }
  }

 private:
  struct Sum {
    double squares = 0;
    int64_t count = 0;
  };
  std::vector<Sum> sums_;
};

// Base class of metrics that are the smallest margin of any joint in any sample. There is no value before the
// first margin.
class JointMargin : public ExtendedMetric {
 public:
  explicit JointMargin(const MetricsConfig& config) : arms_(config.arms) {}
  void Start() override { margin_ = kInfinity; }
  void Values(std::span<double> values) const override { values[0] = margin_ < kInfinity ? margin_ : kNone; }

 protected:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<ArmConfig> arms_;
  double margin_ = kInfinity;
};

// Smallest distance (rad) of any arm joint to its nearer limit; negative beyond the limit. A joint with lower
// >= upper is ignored. (In a model, a joint without limits has a range of one turn in each direction.) There
// is no value before the first sample, or if no joint has a range.
class JointLimitMargin : public JointMargin {
 public:
  static constexpr const char* kNames[] = {"min_joint_limit_margin_rad"};
  using JointMargin::JointMargin;
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < arms_.size(); ++k) {
      const std::span<const double> q = derived.sample.arm[k].joint_position;
      const std::vector<double>&lower = arms_[k].joint_lower, &upper = arms_[k].joint_upper;
      for (size_t j = 0; j < lower.size(); ++j) {
        if (lower[j] < upper[j]) margin_ = std::min({margin_, q[j] - lower[j], upper[j] - q[j]});
      }
    }
  }
};

// Smallest value of 1 - |torque| / limit of any arm joint, over all physics steps. The torque includes
// gravity compensation. A joint at its limit has the value 0; beyond its limit, the value is negative. There
// is no value if no joint has a limit or the source does not provide torques.
class JointTorqueMargin : public JointMargin {
 public:
  static constexpr const char* kNames[] = {"min_joint_torque_margin"};
  using JointMargin::JointMargin;
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < arms_.size(); ++k) {
      const std::span<const double> torque = derived.sample.arm[k].joint_torque_peak;
      const std::vector<double>& limit = arms_[k].joint_torque_limit;
      for (size_t j = 0; j < std::min(torque.size(), limit.size()); ++j) {
        if (limit[j] > 0) margin_ = std::min(margin_, 1 - torque[j] / limit[j]);
      }
    }
  }
};

// Integral over time of |torque . velocity|, the magnitude of the arm's mechanical power, J. Braking counts
// as work too. The sim integrates at every physics step. Samples would not suffice: they are taken at the end
// of a control tick, where power is smallest because the servos have caught up with their commands. There is
// no value if the source does not provide the work.
class MechanicalWork : public ExtendedMetric {
 public:
  static constexpr const char* kNames[] = {"mechanical_work_J"};
  explicit MechanicalWork(const MetricsConfig& config) : work_(config.arms.size()) {}

  void Start() override { work_.assign(work_.size(), kNone); }
  void Add(const DerivedSample& derived) override {
    for (size_t k = 0; k < work_.size(); ++k)
      work_[k] = derived.sample.arm[k].mechanical_work.value_or(kNone);
  }
  void Values(std::span<double> values) const override {
    std::copy(work_.begin(), work_.end(), values.begin());
  }

 private:
  std::vector<double> work_;
};

}  // namespace evalbus::metrics
