// What every policy is to the rest: it begins an episode, then answers each state with an action.
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

// What a policy reports to its owner. Each member may be empty.
struct PolicyCallbacks {
  // Records what the policy was shown, and what it answered.
  std::function<void(const observation_t&)> on_observation;
  std::function<void(const policy_action_t&)> on_policy_action;
  // Logs one line for people as a warning.
  std::function<void(const std::string&)> note;
  // May be called from any thread: Think() or IsReady() has news. Policies that compute on a thread of their
  // own should call it as soon as they have the result; otherwise it is noticed up to 100 ms later.
  std::function<void()> wake;
};

// Deterministic: actions depend on the model, the episode's seed and the states alone. Time is the state's
// sim_time_us.
class Policy {
 public:
  virtual ~Policy() = default;

  // Forgets the last episode. Throws InputError if this episode cannot be played (replay).
  virtual void Begin(const episode_begin_t& begin) = 0;

  // Fills the targets of all arms and grippers for the tick of `state`; the action is empty before each call,
  // and the caller fills its header. Called for each tick from 0, in order. Throws std::runtime_error, one
  // line, to end the episode with policy_error.
  virtual void Act(const state_t& state, action_t* action) = 0;

  // What follows is for policies that take time or need images. Other policies are always ready and need
  // none.

  // Called after Begin() until it returns true: the episode may start.
  virtual bool IsReady() { return true; }
  // Called for the tick of `state` until it returns true: Act() may be called. Throws as Act() does.
  virtual bool Think(const state_t& /*state*/) { return true; }
  // After a Think() that returned false: when to call it again at the latest.
  virtual std::chrono::steady_clock::time_point think_again_at() const {
    return std::chrono::steady_clock::time_point::max();
  }
  // Images that it needs before Think() can proceed; null: none. They are passed to OnImage() as they arrive.
  virtual const image_request_t* image_request() const { return nullptr; }
  // An image without data: the tick that was asked for is no longer available; ask for a newer one.
  virtual void OnImage(const image_t& /*image*/) {}
  virtual void SetCallbacks(const PolicyCallbacks& /*callbacks*/) {}
};

}  // namespace evalbus::policy
