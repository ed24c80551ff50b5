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
  // Record what the policy observed, and what it returned.
  std::function<void(const observation_t&)> on_observation;
  std::function<void(const policy_action_t&)> on_policy_action;
  // Logs one line as a warning.
  std::function<void(const std::string&)> note;
  // Notifies the owner that the result of Compute() or IsReady() may have changed. May be called from any
  // thread. Policies that compute on a thread of their own should call it as soon as they have the result;
  // otherwise it is noticed up to 100 ms later.
  std::function<void()> wake;
};

// Must be deterministic: actions may depend only on the model, the episode's seed and the states. The time is
// the state's sim_time_us.
class Policy {
 public:
  virtual ~Policy() = default;

  // Begins an episode and discards the state of the previous one. Throws InputError if this episode cannot be
  // played (replay).
  virtual void Begin(const episode_begin_t& begin) = 0;

  // Fills the targets of all arms and grippers for the tick of `state`. The action is empty before each call,
  // and the caller fills its header. Called for each tick from 0, in order. To end the episode with
  // policy_error, throw std::runtime_error with a one-line message.
  virtual void Act(const state_t& state, action_t* action) = 0;

  // The members below are for policies that take time or need images. By default, a policy is always ready
  // and needs no images.

  // Called repeatedly after Begin() until it returns true; then the episode may start.
  virtual bool IsReady() { return true; }
  // Called repeatedly for the tick of `state` until it returns true; then Act() may be called. Throws as
  // Act() does.
  virtual bool Compute(const state_t& /*state*/) { return true; }
  // After a Compute() that returned false: latest time at which to call it again.
  virtual std::chrono::steady_clock::time_point compute_again_at() const {
    return std::chrono::steady_clock::time_point::max();
  }
  // Images that the policy needs before Compute() can proceed; null: none. They are passed to OnImage() as
  // they arrive.
  virtual const image_request_t* image_request() const { return nullptr; }
  // Receives an image. If it has no data, the requested tick is no longer available; request a newer one.
  virtual void OnImage(const image_t& /*image*/) {}
  virtual void SetCallbacks(const PolicyCallbacks& /*callbacks*/) {}
};

}  // namespace evalbus::policy
