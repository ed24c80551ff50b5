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
  // The component itself, for all in one process.
  std::unique_ptr<Component> (*make)(Bus* bus, const RunOptions& options);

  std::string program() const { return "evalbus-" + std::string(name); }
};

// In the order in which they start.
std::span<const ComponentType> AllComponents();

// Those that this run starts: without the policy where it is somebody else's process.
std::vector<ComponentType> ComponentsOf(const RunOptions& options);

// Names of those an episode waits for.
std::vector<std::string> RequiredComponents();

}  // namespace evalbus::launch
