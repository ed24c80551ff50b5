// Who takes part in the episode, as their STATUS says: who is ready, who lags, who is there twice. Pure.
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
  // Begins the episode that `start` commands: no component is ready for it yet. own_instance: of the sim
  // itself.
  void Begin(const command_t& start, int64_t own_instance);

  // False if it was ignored: it is of another process than the known one of this name, or there are too many
  // names.
  bool Hear(const component_status_t& status);

  // Names of the required components that are not ready for this episode, with commas; empty if all are.
  std::string Missing() const;
  // A component that announced a lag window and is that far behind the tick, or further; empty if none is.
  std::string Lagging(int64_t tick) const;
  // The last tick that a component has said it handled in this episode; -1 before the first.
  int64_t LastTick(const std::string& component) const;
  // A component that is ready for this episode in two processes, or in another process than the command
  // requires; empty if there is none.
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
  // The process of each component: as required, else the first one that was ready for this episode.
  std::map<std::string, int64_t> instances_;
  std::string twice_;
};

}  // namespace evalbus::sim
