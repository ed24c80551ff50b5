// Measures the time between the first and the last score of each episode, as any observer of a run receives
// them.
#pragma once

#include <chrono>

#include "base/errors.h"
#include "runner/launch.h"

namespace evalbus {

class Stopwatch : public runner::RunListener {
 public:
  static constexpr double kTimestep = 0.002;  // physics time step, s

  void OnPartial(const partial_metrics_t& partial) override {
    if (partial.header.tick == 0) first_ = std::chrono::steady_clock::now();
    last_us_ = partial.header.sim_time_us;
    last_ = std::chrono::steady_clock::now();
  }
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override {
    if (!episode["complete"]) throw EnvironmentError("the timed episode is incomplete");
    wall_s += std::chrono::duration<double>(last_ - first_).count();
    steps += static_cast<double>(last_us_) * 1e-6 / kTimestep;
    successes += episode["metrics"]["success"] == 1.0;
  }

  // Sums over all episodes: wall-clock time and number of physics steps.
  double wall_s = 0;
  double steps = 0;
  int successes = 0;

 private:
  SteadyTime first_{}, last_{};
  int64_t last_us_ = 0;
};

}  // namespace evalbus
