// Determines from STATUS messages which components of the episode are ready, lag behind, or are present
// twice. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "evalbus/command_t.hpp"
#include "evalbus/component_status_t.hpp"

namespace evalbus::sim {

class ReadinessTracker {
 public:
  // Begins the episode that `start` commands; no component is ready for it yet. own_instance: instance of the
  // sim itself.
  void Begin(const command_t& start, int64_t own_instance);

  // Handles a STATUS. Returns false if it was ignored, because another process is known under the name of the
  // sim or of a required component, or because there are too many names.
  bool Update(const component_status_t& status);

  // Returns the names of the required components that are not ready for this episode, separated by commas.
  // Empty if all are ready.
  std::string Missing() const;
  // Returns a component whose last handled tick is at least its lag window behind `tick`. Empty if there is
  // none.
  std::string Lagging(int64_t tick) const;
  // Returns the last tick that the component has reported as handled in this episode; -1 before the first.
  int64_t LastTick(const std::string& component) const;
  // Returns a component that is ready for this episode in two processes, or in a process other than the one
  // that the command requires. Empty if there is none.
  const std::string& twice() const { return twice_; }

 private:
  struct Member {
    int32_t episode = -1, attempt = -1;
    bool ready = false;
    int64_t last_tick = -1;
    int64_t lag_window_ticks = 0;
  };
  bool IsHere(const Member& member) const { return member.episode == episode_ && member.attempt == attempt_; }
  bool IsRequired(const std::string& component) const;

  int32_t episode_ = -1, attempt_ = -1;
  std::vector<std::string> required_;
  std::map<std::string, Member> members_;
  // Instance of the sim and of each required component: the instance that the command requires, otherwise the
  // first one that was ready for this episode.
  std::map<std::string, int64_t> instances_;
  std::string twice_;
};

}  // namespace evalbus::sim
