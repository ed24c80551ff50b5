#include "policy_bridge/policies/simple_policies.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "policy_bridge/experts/expert.h"
#include "policy_bridge/planning/min_jerk.h"

namespace evalbus::policy {
namespace {

// Numbers of the random streams that are derived from an episode's seed.
constexpr uint32_t kRandomStream = 1, kNoiseStream = 2;

constexpr int kNumSines = 3;
constexpr double kMinFrequency = 0.05;  // Hz
constexpr double kRampTime = 1;         // s

constexpr double kRandomAmplitude = 0.4;  // rad
constexpr double kRandomFrequency = 0.3;  // Hz
constexpr double kNoiseFrequency = 0.7;   // Hz

double Time(const state_t& state) { return static_cast<double>(state.header.sim_time_us) * 1e-6; }

}  // namespace

SmoothNoise::SmoothNoise(Random* random, double amplitude, double max_frequency) {
  for (int i = 0; i < kNumSines; ++i) {
    const double rate = 2 * std::numbers::pi * random->Uniform(kMinFrequency, max_frequency);
    sines_.push_back({amplitude / kNumSines, rate, random->Uniform(0, 2 * std::numbers::pi)});
  }
}

double SmoothNoise::At(double time) const {
  double sum = 0;
  for (const Sine& sine : sines_) sum += sine.amplitude * std::sin(sine.rate * time + sine.phase);
  return MinJerk(time / kRampTime) * sum;
}

void HoldPolicy::Act(const state_t&, action_t* action) { SetAction(home_, action); }

RandomPolicy::RandomPolicy(const model_info_t& info) : info_(info), home_(HomeConfiguration(info)) {}

void RandomPolicy::Begin(const episode_begin_t& begin) {
  Random random(begin.seed, kRandomStream);
  joints_.clear();
  grippers_.clear();
  for (size_t i = 0; i < CountJoints(info_); ++i)
    joints_.emplace_back(&random, kRandomAmplitude, kRandomFrequency);
  for (size_t i = 0; i < info_.gripper.size(); ++i) grippers_.emplace_back(&random, 1.0, kRandomFrequency);
}

void RandomPolicy::Act(const state_t& state, action_t* action) {
  const double time = Time(state);
  Configuration now = home_;
  size_t next = 0;
  for (size_t i = 0; i < now.joints.size(); ++i) {
    for (Eigen::Index j = 0; j < now.joints[i].size(); ++j) {
      const auto index = static_cast<size_t>(j);
      now.joints[i][j] = std::clamp(now.joints[i][j] + joints_[next++].At(time),
                                    info_.arm[i].joint_lower_rad[index], info_.arm[i].joint_upper_rad[index]);
    }
  }
  for (size_t i = 0; i < grippers_.size(); ++i) now.closing[i] = std::abs(grippers_[i].At(time));
  SetAction(now, action);
}

NoisyPolicy::NoisyPolicy(std::unique_ptr<Policy> policy, const model_info_t& info, double amplitude)
    : policy_(std::move(policy)), amplitude_(amplitude) {
  for (const arm_info_t& arm : info.arm) {
    lower_.insert(lower_.end(), arm.joint_lower_rad.begin(), arm.joint_lower_rad.end());
    upper_.insert(upper_.end(), arm.joint_upper_rad.begin(), arm.joint_upper_rad.end());
  }
}

void NoisyPolicy::Begin(const episode_begin_t& begin) {
  policy_->Begin(begin);
  Random random(begin.seed, kNoiseStream);
  joints_.clear();
  for (size_t i = 0; i < lower_.size(); ++i) joints_.emplace_back(&random, amplitude_, kNoiseFrequency);
}

void NoisyPolicy::Act(const state_t& state, action_t* action) {
  policy_->Act(state, action);
  const double time = Time(state);
  for (size_t i = 0; i < joints_.size(); ++i) {
    double& target = action->joint_position_rad[i];
    target = std::clamp(target + joints_[i].At(time), lower_[i], upper_[i]);
  }
}

}  // namespace evalbus::policy
