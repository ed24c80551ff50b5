// What every policy is to the rest: it begins an episode, then answers each state with an action.
#pragma once

#include <functional>
#include <string>

#include "evalbus/action_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/observation_t.hpp"
#include "evalbus/observe_t.hpp"
#include "evalbus/policy_action_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::policy {

// Where a policy tells what it saw and said.
struct PolicyRecord {
  std::function<void(const observation_t&)> saw;
  std::function<void(const policy_action_t&)> said;
  // What people should know now, one line.
  std::function<void(const std::string&)> note;
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

  // What follows is for policies that look and take their time. Others are always ready and see nothing.

  // Asked again and again after Begin(), until true: the episode may start.
  virtual bool IsReady() { return true; }
  // Asked again and again for the tick of `state`, until true: Act() may be called. Throws as Act() does.
  virtual bool Think(const state_t& /*state*/) { return true; }
  // Pictures that it needs before it can go on thinking; null: none. They are given to See() as they come.
  virtual const observe_t* Wants() const { return nullptr; }
  virtual void See(const image_t& /*image*/) {}
  virtual void SetRecord(const PolicyRecord& /*record*/) {}
};

}  // namespace evalbus::policy
