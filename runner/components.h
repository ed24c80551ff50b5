// The table of all components of a run.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/component.h"
#include "runner/run_options.h"

namespace evalbus::runner {

struct ComponentType {
  // Name in STATUS.
  std::string_view name;
  // Program that contains the component, and the argument that selects the component if the program has
  // several.
  std::string_view program;
  std::string_view argument;
  // True if an episode starts only when this component is ready. False for the sim, which does the waiting.
  bool is_required;
  // Real-time priority with --realtime (base/realtime.h); 0 for components without deadlines. The sim's is
  // the highest.
  int realtime_priority;
  // Creates the component, for a run with all components in one process.
  std::unique_ptr<Component> (*make)(Bus* bus, const RunOptions& options);
};

// Priority of the sim, and of a process that contains all components.
inline constexpr int kSimRealtimePriority = 20;

// All components, in the order in which they are started.
std::span<const ComponentType> AllComponents();

// Components that this run starts: no policy if it is an external process, cameras only if the policy needs
// images, a source instead of sim and policy for `evalbus watch`.
std::vector<ComponentType> ComponentsOf(const RunOptions& options);

// Names of the components that episodes wait for.
std::vector<std::string> RequiredComponents(const RunOptions& options);

}  // namespace evalbus::runner
