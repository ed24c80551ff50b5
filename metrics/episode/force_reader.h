// Reads the contact forces of a tick from STATE for the metrics. Pure.
#pragma once

#include <algorithm>
#include <vector>

#include "evalbus/contact_force_t.hpp"
#include "evalbus/state_t.hpp"
#include "metrics/sample/sample.h"

namespace evalbus::metrics {

class ForceReader {
 public:
  // dt: time between ticks, s.
  explicit ForceReader(double dt) : dt_(dt) {}

  // The result points into `state` and into this object; it is valid until the next call.
  ForceSample Read(const state_t& state) {
    ForceSample sample{
        .scene = state.scene_force_N, .object = state.object_force_N, .self = state.self_force_N};
    for (const contact_force_t& force : state.contact_force) {
      if (force.kind != contact_force_t::SCENE && force.kind != contact_force_t::SELF) continue;
      sample.unwanted_impulse += force.mean_force_N * dt_;
      sample.unwanted_touch_energy = std::max(sample.unwanted_touch_energy, force.touch_energy_J);
    }
    grip_.clear();
    for (const gripper_state_t& gripper : state.gripper) {
      grip_.push_back({gripper.grip_force_peak_N, gripper.grip_force_mean_N * dt_, gripper.grip_time_s});
    }
    sample.grip = grip_;
    return sample;
  }

 private:
  double dt_;
  std::vector<GripSample> grip_;
};

}  // namespace evalbus::metrics
