// Policies that do not plan: hold, random, and noise that is added to another policy.
#pragma once

#include <memory>
#include <vector>

#include "base/random.h"
#include "evalbus/model_info_t.hpp"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

// Smooth noise: a sum of three sines of random frequency and phase, which grows from zero during the first
// second. It is a function of time only, so it does not depend on the control rate.
class SmoothNoise {
 public:
  // Frequencies are uniform in [0.05, max_frequency] Hz. Values stay within +-amplitude.
  SmoothNoise(Random* random, double amplitude, double max_frequency);
  double At(double time) const;

 private:
  struct Sine {
    double amplitude, rate, phase;
  };
  std::vector<Sine> sines_;
};

// Stays at home with open grippers.
class HoldPolicy : public Policy {
 public:
  explicit HoldPolicy(const model_info_t& info) : home_(HomeConfiguration(info)) {}
  void Begin(const episode_begin_t&) override {}
  void Act(const state_t& state, action_t* action) override;

 private:
  Configuration home_;
};

// Moves every joint smoothly within +-0.4 rad of home (and within its limits), and every gripper between open
// and closed.
class RandomPolicy : public Policy {
 public:
  explicit RandomPolicy(const model_info_t& info);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  model_info_t info_;
  Configuration home_;
  std::vector<SmoothNoise> joints_, grippers_;
};

// Adds smooth noise of at most +-amplitude to each joint target of another policy. kAmplitude moves the hand
// by about 7 cm, so that some grasps are missed.
class NoisyPolicy : public Policy {
 public:
  static constexpr double kAmplitude = 0.09;  // rad

  NoisyPolicy(std::unique_ptr<Policy> policy, const model_info_t& info, double amplitude = kAmplitude);
  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

 private:
  std::unique_ptr<Policy> policy_;
  double amplitude_;  // rad
  std::vector<double> lower_, upper_;
  std::vector<SmoothNoise> joints_;
};

}  // namespace evalbus::policy
