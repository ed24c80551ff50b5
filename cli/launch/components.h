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
  // As in STATUS.
  std::string_view name;
  // Its program and, where that can be several components, the argument that makes it this one.
  std::string_view program;
  std::string_view argument;
  // The episode waits until it is ready. (The sim is who waits.)
  bool is_required;
  // With --realtime (base/realtime.h); 0 for who need not be in time. The sim goes before all.
  int realtime_priority;
  // The component itself, for all in one process.
  std::unique_ptr<Component> (*make)(Bus* bus, const RunOptions& options);
};

// Of the sim, or of all in one process.
inline constexpr int kSimRealtimePriority = 20;

// In the order in which they start.
std::span<const ComponentType> AllComponents();

// Those that this run starts: without the policy where it is somebody else's process, with cameras where the
// policy looks, with a source in place of sim and policy where it watches.
std::vector<ComponentType> ComponentsOf(const RunOptions& options);

// Names of those that its episodes wait for.
std::vector<std::string> RequiredComponents(const RunOptions& options);

}  // namespace evalbus::launch
