#include "cli/launch/components.h"

#include <algorithm>

#include "bus/recorder/recorder.h"
#include "collision/collision_component.h"
#include "metrics/episode/part_of_run.h"
#include "metrics/metrics_component.h"
#include "policy_bridge/policy_component.h"
#include "sim/sim_component.h"

namespace evalbus::launch {
namespace {

constexpr bool kRequired = true;

template <class Type>
std::unique_ptr<Component> Make(Bus* bus, const RunOptions&) {
  return std::make_unique<Type>(bus);
}
std::unique_ptr<Component> MakeMetrics(Bus* bus, const RunOptions& options) {
  return std::make_unique<metrics::MetricsComponent>(bus, metrics::IsPartOfRun(options.out));
}
std::unique_ptr<Component> MakeRecorder(Bus* bus, const RunOptions& options) {
  return std::make_unique<Recorder>(bus, options.out);
}
std::unique_ptr<Component> MakePolicy(Bus* bus, const RunOptions& options) {
  return std::make_unique<policy::PolicyComponent>(bus, options.policy.policy);
}
std::unique_ptr<Component> MakeSim(Bus* bus, const RunOptions& options) {
  sim::SimOptions sim = options.sim;
  sim.out = options.out;
  return std::make_unique<sim::SimComponent>(bus, sim);
}

constexpr ComponentType kComponents[] = {
    {"recorder", kRequired, 0, MakeRecorder},
    {"collision", kRequired, 10, Make<collision::CollisionComponent>},
    {"metrics", kRequired, 10, MakeMetrics},
    {"policy", kRequired, 10, MakePolicy},
    {"sim", !kRequired, kSimRealtimePriority, MakeSim},
};

}  // namespace

std::span<const ComponentType> AllComponents() { return kComponents; }

std::vector<ComponentType> ComponentsOf(const RunOptions& options) {
  std::vector<ComponentType> components;
  std::ranges::copy_if(kComponents, std::back_inserter(components), [&](const ComponentType& type) {
    return type.name != "policy" || options.policy.policy != kExternalPolicy;
  });
  return components;
}

std::vector<std::string> RequiredComponents() {
  std::vector<std::string> names;
  for (const ComponentType& type : kComponents) {
    if (type.is_required) names.emplace_back(type.name);
  }
  return names;
}

}  // namespace evalbus::launch
