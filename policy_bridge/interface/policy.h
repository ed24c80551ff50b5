// Interface of all policies: a policy begins an episode, then returns an action for each state.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "evalbus/action_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/image_request_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/observation_t.hpp"
#include "evalbus/policy_action_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::policy {

// Callbacks through which a policy reports to its owner. Each member may be empty.
struct PolicyCallbacks {
  // Called with the data to record: what the policy observed, and what it returned.
  std::function<void(const observation_t&)> on_observation;
  std::function<void(const policy_action_t&)> on_policy_action;
  // Called with a line to log as a warning.
  std::function<void(const std::string&)> note;
  // Notifies the owner that the result of Compute() or IsReady() may have changed. May be called from any
  // thread. Policies that compute on a separate thread should call it as soon as they have the result.
  // Otherwise the owner notices the result up to 100 ms later.
  std::function<void()> wake;
};

// A policy must be deterministic: its actions may depend only on the model, the episode's seed and the
// states. It must take the time from sim_time_us of the state.
class Policy {
 public:
  virtual ~Policy() = default;

  // Begins an episode and discards the state of the previous episode. Throws InputError if the policy cannot
  // play this episode (e.g. a replay whose recording lacks it).
  virtual void Begin(const episode_begin_t& begin) = 0;

  // Fills the targets of all arms and grippers for the tick of `state`. The action is empty before each call,
  // and the caller fills its header. Called in the order of ticks. With a real-time clock, ticks are skipped
  // if a new state arrives before Compute() has returned true. To end the episode with policy_error, throw
  // std::runtime_error with a one-line message.
  virtual void Act(const state_t& state, action_t* action) = 0;

  // The members below are for policies that need time or images. By default, a policy is always ready and
  // needs no images.

  // Is called repeatedly after Begin() until it returns true. The episode cannot start before that.
  virtual bool IsReady() { return true; }
  // Is called repeatedly for the tick of `state` until it returns true. Act() is called only after that.
  // Throws the errors of Act().
  virtual bool Compute(const state_t& /*state*/) { return true; }
  // Returns the latest time at which Compute() must be called again after it has returned false.
  virtual std::chrono::steady_clock::time_point compute_again_at() const {
    return std::chrono::steady_clock::time_point::max();
  }
  // Images that the policy needs before Compute() can proceed, or null if it needs none. They are passed to
  // OnImage() as they arrive.
  virtual const image_request_t* image_request() const { return nullptr; }
  // Receives an image. An image without data means that the requested tick is no longer available; the policy
  // should then request a newer one.
  virtual void OnImage(const image_t& /*image*/) {}
  virtual void SetCallbacks(const PolicyCallbacks& /*callbacks*/) {}
};

}  // namespace evalbus::policy
