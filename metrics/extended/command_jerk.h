// Smoothness of the policy's commands, in contrast to the smoothness of the robot's movement. Definition and
// source: speed_jerk.h.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "metrics/extended/speed_jerk.h"

namespace evalbus::metrics {

// Dimensionless jerk of the speed at which each arm's joint commands change, norm(c_i - c_(i-1)) over its
// joints. There is no value if the source does not provide commands.
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
    if (command.size() != previous.size()) return std::numeric_limits<double>::quiet_NaN();
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

}  // namespace evalbus::metrics
