// The one table of the components that a run is made of.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/component.h"
#include "cli/launch/run_options.h"

namespace evalbus::launch {

struct ComponentType {
  // As in STATUS; its program is evalbus-NAME.
  std::string_view name;
  // The episode waits until it is ready. (The sim is who waits.)
  bool is_required;
  // With --realtime (base/realtime.h); 0 for who need not be in time. The sim goes before all.
  int realtime_priority;
  // The component itself, for all in one process.
  std::unique_ptr<Component> (*make)(Bus* bus, const RunOptions& options);

  std::string program() const { return "evalbus-" + std::string(name); }
};

// Of the sim, or of all in one process.
inline constexpr int kSimRealtimePriority = 20;

// In the order in which they start.
std::span<const ComponentType> AllComponents();

// Those that this run starts: without the policy where it is somebody else's process.
std::vector<ComponentType> ComponentsOf(const RunOptions& options);

// Names of those an episode waits for.
std::vector<std::string> RequiredComponents();

}  // namespace evalbus::launch
