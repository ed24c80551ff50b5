#include "runner/components.h"

#include <algorithm>
#include <optional>

#include "bus/recorder/recorder.h"
#include "collision/collision_component.h"
#include "lcmtypes/source.h"
#include "metrics/episode/part_of_run.h"
#include "metrics/metrics_component.h"
#include "policy_bridge/policy_component.h"
#include "sim/sim_component.h"
#include "sim/source_component.h"
#include "viz/camera_component.h"

namespace evalbus::runner {
namespace {

constexpr bool kRequired = true;

std::unique_ptr<Component> MakeCameras(Bus* bus, const RunOptions& options) {
  return std::make_unique<viz::CameraComponent>(bus, options.gl);
}
std::unique_ptr<Component> MakeCollision(Bus* bus, const RunOptions& options) {
  return std::make_unique<collision::CollisionComponent>(bus, options.sim.contacts == contacts_from::kSource);
}
std::unique_ptr<Component> MakeMetrics(Bus* bus, const RunOptions& options) {
  return std::make_unique<metrics::MetricsComponent>(bus, metrics::IsPartOfRun(options.out));
}
std::unique_ptr<Component> MakeRecorder(Bus* bus, const RunOptions& options) {
  return std::make_unique<Recorder>(bus, options.out, ParseLogForm(options.recorder.log));
}
std::unique_ptr<Component> MakePolicy(Bus* bus, const RunOptions& options) {
  return std::make_unique<policy::PolicyComponent>(bus, options.policy);
}
std::unique_ptr<Component> MakeSim(Bus* bus, const RunOptions& options) {
  sim::SimOptions sim = options.sim;
  sim.out = options.out;
  return std::make_unique<sim::SimComponent>(bus, sim);
}

std::unique_ptr<Component> MakeSource(Bus* bus, const RunOptions& options) {
  sim::SimOptions sim = options.sim;
  sim.out = options.out;
  return std::make_unique<sim::SourceComponent>(bus, sim);
}

constexpr std::string_view kSource = "--source";

constexpr ComponentType kComponents[] = {
    {"recorder", "evalbus-recorder", "", kRequired, 0, MakeRecorder},
    {"collision", "evalbus-collision", "", kRequired, 10, MakeCollision},
    {"metrics", "evalbus-metrics", "", kRequired, 10, MakeMetrics},
    {"cameras", "evalbus-viz", "--answer-image-requests", kRequired, 10, MakeCameras},
    {"policy", "evalbus-policy", "", kRequired, 10, MakePolicy},
    {"sim", "evalbus-sim", "", !kRequired, kSimRealtimePriority, MakeSim},
    {"sim", "evalbus-sim", kSource, !kRequired, 0, MakeSource},
};

// Returns true if the run has this component. It may be a process that the run does not start.
bool TakesPart(const ComponentType& type, const RunOptions& options) {
  if (type.name == "sim") return options.watch == (type.argument == kSource);
  if (options.watch && type.name == "policy") return false;
  if (type.name != "cameras") return true;
  const std::optional<policy::Contract> contract = policy::FindContractOf(options.policy);
  return contract && contract->needs_images();
}

}  // namespace

std::span<const ComponentType> AllComponents() { return kComponents; }

std::vector<ComponentType> ComponentsOf(const RunOptions& options) {
  std::vector<ComponentType> components;
  std::ranges::copy_if(kComponents, std::back_inserter(components), [&](const ComponentType& type) {
    return TakesPart(type, options) &&
           (type.name != "policy" || options.policy.policy != policy::kExternalPolicy);
  });
  return components;
}

std::vector<std::string> RequiredComponents(const RunOptions& options) {
  std::vector<std::string> names;
  for (const ComponentType& type : kComponents) {
    if (type.is_required && TakesPart(type, options)) names.emplace_back(type.name);
  }
  return names;
}

}  // namespace evalbus::runner
