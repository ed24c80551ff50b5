// What every policy is to the rest: it begins an episode, then answers each state with an action.
#pragma once

#include "evalbus/action_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::policy {

// Deterministic: actions depend on the model, the episode's seed and the states alone. Time is the state's
// sim_time_us.
class Policy {
 public:
  virtual ~Policy() = default;

  // Forgets the last episode. Throws InputError if this episode cannot be played (replay).
  virtual void Begin(const episode_begin_t& begin) = 0;

  // Fills the targets of all arms and grippers for the tick of `state`; the header is the caller's business.
  // Called for each tick from 0, in order. Throws std::runtime_error, one line, where the policy cannot go
  // on.
  virtual void Act(const state_t& state, action_t* action) = 0;
};

}  // namespace evalbus::policy
