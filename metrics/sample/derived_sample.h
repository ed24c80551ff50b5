// A sample together with the quantities that several metrics derive from it.
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "metrics/sample/metrics_config.h"
#include "metrics/sample/robot_contacts.h"
#include "metrics/sample/sample.h"

namespace evalbus::metrics {

struct DerivedSample {
  const Sample& sample;
  // True if the previous tick was a sample too; false for the first sample and after a missing sample.
  bool in_a_row;
  // Unit quaternion (w, x, y, z) of each arm's wrist, and the wrist's speed norm(p_i - p_(i-1)) / dt in m/s,
  // which is 0 unless in_a_row.
  std::span<const std::array<double, 4>> wrist_quat;
  std::span<const double> wrist_speed;
  const RobotContacts& contacts;
};

class SampleDeriver {
 public:
  explicit SampleDeriver(const MetricsConfig& config)
      : dt_(config.control_dt),
        owners_(config.geom_owner),
        quat_(config.arms.size()),
        speed_(config.arms.size()),
        last_wrist_(config.arms.size()) {}

  // Begins an episode.
  void Start() { last_tick_ = kNone; }

  // Samples must come in tick order and have the sizes given by the config. The result is valid until the
  // next call.
  DerivedSample Derive(const Sample& sample) {
    const bool in_a_row = last_tick_ != kNone && sample.tick == last_tick_ + 1;
    last_tick_ = sample.tick;
    for (size_t k = 0; k < quat_.size(); ++k) {
      const std::array<double, 3>& p = sample.arm[k].wrist_position;
      double sum = 0;
      for (int i = 0; i < 3; ++i) sum += (p[i] - last_wrist_[k][i]) * (p[i] - last_wrist_[k][i]);
      speed_[k] = in_a_row ? std::sqrt(sum) / dt_ : 0;
      last_wrist_[k] = p;
      quat_[k] = sample.arm[k].wrist_quat;
      const double norm = Norm(quat_[k]);
      for (double& component : quat_[k]) component /= norm;
    }
    contacts_.Sort(sample.contacts, owners_);
    return {sample, in_a_row, quat_, speed_, contacts_};
  }

  // Contacts of the last sample.
  const RobotContacts& contacts() const { return contacts_; }

  static double Norm(const std::array<double, 4>& q) {
    return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  }

 private:
  static constexpr int64_t kNone = -1;
  double dt_;
  GeomOwners owners_;
  RobotContacts contacts_;
  std::vector<std::array<double, 4>> quat_;
  std::vector<double> speed_;
  std::vector<std::array<double, 3>> last_wrist_;
  int64_t last_tick_ = kNone;
};

}  // namespace evalbus::metrics
