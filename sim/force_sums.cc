#include "sim/force_sums.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "evalbus/contact_force_t.hpp"

namespace evalbus::sim {
namespace {

double NormOf(const std::array<double, 3>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

ForceSums::ForceSums(std::vector<int> fingers, int objects, double timestep)
    : fingers_(std::move(fingers)),
      objects_(static_cast<size_t>(objects)),
      timestep_(timestep),
      finger_force_(static_cast<size_t>(std::accumulate(fingers_.begin(), fingers_.end(), 0)) * objects_),
      grips_(fingers_.size()) {
  pairs_.reserve(256);
}

void ForceSums::Start() {
  pairs_.clear();
  StartTick();
}

void ForceSums::StartTick() {
  std::erase_if(pairs_, [](const Pair& pair) { return !pair.touches; });
  for (Pair& pair : pairs_) {
    pair.peak = pair.sum = pair.touch_energy = 0;
    pair.impulse = {};
  }
  for (std::vector<double>& forces : largest_) forces.clear();
  std::ranges::fill(grips_, Grip{});
  steps_ = 0;
}

ForceSums::Pair& ForceSums::Find(const ContactPoint& point) {
  const auto found = std::ranges::find_if(
      pairs_, [&](const Pair& pair) { return pair.Is(point.kind, point.body_a, point.body_b); });
  if (found != pairs_.end()) return *found;
  return pairs_.emplace_back(Pair{.kind = point.kind, .body_a = point.body_a, .body_b = point.body_b});
}

void ForceSums::AddStep(std::span<const ContactPoint> points) {
  ++steps_;
  for (Pair& pair : pairs_) {
    pair.touches = false;
    pair.force = {};
  }
  std::ranges::fill(finger_force_, 0);
  for (const ContactPoint& point : points) {
    if (point.finger >= 0 && point.object >= 0) {
      finger_force_[static_cast<size_t>(point.finger) * objects_ + static_cast<size_t>(point.object)] +=
          point.normal_force;
    }
    Pair& pair = Find(point);
    pair.touches = true;
    for (size_t i = 0; i < 3; ++i) pair.force[i] += point.force[i];
    pair.touch_energy = std::max(pair.touch_energy, point.touch_energy);
  }
  std::array<double, 3> largest{};
  for (Pair& pair : pairs_) {
    if (!pair.touches) continue;
    const double force = NormOf(pair.force);
    pair.peak = std::max(pair.peak, force);
    pair.sum += force;
    for (size_t i = 0; i < 3; ++i) pair.impulse[i] += pair.force[i] * timestep_;
    if (pair.kind == contact_force_t::OTHER) continue;
    double& kind = largest[static_cast<size_t>(pair.kind)];
    kind = std::max(kind, force);
  }
  for (size_t kind = 0; kind < largest.size(); ++kind) {
    if (largest[kind] > 0) largest_[kind].push_back(largest[kind]);
  }
  AddGrips();
}

void ForceSums::AddGrips() {
  size_t finger = 0;
  for (size_t gripper = 0; gripper < grips_.size(); ++gripper) {
    const size_t end = finger + static_cast<size_t>(fingers_[gripper]);
    double grip = 0;
    for (size_t object = 0; object < objects_ && finger < end; ++object) {
      double smallest = finger_force_[finger * objects_ + object];
      for (size_t other = finger + 1; other < end; ++other) {
        smallest = std::min(smallest, finger_force_[other * objects_ + object]);
      }
      grip = std::max(grip, smallest);
    }
    finger = end;
    grips_[gripper].peak = std::max(grips_[gripper].peak, grip);
    grips_[gripper].sum += grip;
    grips_[gripper].steps += grip > 0;
  }
}

bool ForceSums::Touched(int8_t kind, int body_a, int body_b) const {
  return std::ranges::any_of(pairs_,
                             [&](const Pair& pair) { return pair.touches && pair.Is(kind, body_a, body_b); });
}

void ForceSums::Fill(state_t* state) const {
  const double steps = static_cast<double>(std::max<int64_t>(steps_, 1));
  std::vector<contact_force_t>& forces = state->contact_force;
  forces.clear();
  if (steps_ > 0) {
    for (const Pair& pair : pairs_) {
      contact_force_t& force = forces.emplace_back();
      force.kind = pair.kind;
      force.body_a = pair.body_a;
      force.body_b = pair.body_b;
      force.peak_force_N = pair.peak;
      force.mean_force_N = pair.sum / steps;
      std::ranges::copy(pair.impulse, force.impulse_Ns);
      force.touch_energy_J = pair.touch_energy;
    }
  }
  std::ranges::sort(forces, {}, [](const contact_force_t& force) {
    return std::tuple(force.body_a, force.body_b, force.kind);
  });
  state->num_contact_forces = static_cast<int32_t>(forces.size());
  state->scene_force_N = largest_[contact_force_t::SCENE];
  state->object_force_N = largest_[contact_force_t::OBJECT];
  state->self_force_N = largest_[contact_force_t::SELF];
  state->num_scene_forces = static_cast<int32_t>(state->scene_force_N.size());
  state->num_object_forces = static_cast<int32_t>(state->object_force_N.size());
  state->num_self_forces = static_cast<int32_t>(state->self_force_N.size());
  for (size_t k = 0; k < grips_.size(); ++k) {
    gripper_state_t& gripper = state->gripper[k];
    gripper.grip_force_peak_N = grips_[k].peak;
    gripper.grip_force_mean_N = grips_[k].sum / steps;
    gripper.grip_time_s = static_cast<double>(grips_[k].steps) * timestep_;
  }
}

}  // namespace evalbus::sim
