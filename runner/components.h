// Lists the components of a run.
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
  // Name of the component in STATUS.
  std::string_view name;
  // Program that contains the component, and the argument that selects it if the program contains several
  // components.
  std::string_view program;
  std::string_view argument;
  // True if an episode starts only when this component is ready. False for the sim, because the sim waits for
  // the other components.
  bool is_required;
  // Real-time priority with --realtime (base/realtime.h); 0 for components without deadlines. The sim has the
  // highest priority.
  int realtime_priority;
  // Creates the component in this process, for runs with --in-process.
  std::unique_ptr<Component> (*make)(Bus* bus, const RunOptions& options);
};

// Priority of the sim, and of a process that contains all components.
inline constexpr int kSimRealtimePriority = 20;

// Returns all components, in the order in which they are started.
std::span<const ComponentType> AllComponents();

// Returns the components that this run starts. A policy that is an external process is omitted, and so are
// cameras if the policy needs no images. For `evalbus watch`, a source replaces sim and policy.
std::vector<ComponentType> ComponentsOf(const RunOptions& options);

// Returns the names of the components for which episodes wait.
std::vector<std::string> RequiredComponents(const RunOptions& options);

}  // namespace evalbus::runner
