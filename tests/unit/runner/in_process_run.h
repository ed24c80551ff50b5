// A run whose components use an in-process bus of the test.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "bus/channels.h"
#include "runner/components.h"
#include "runner/prepared_run.h"

namespace evalbus::runner {

class InProcessRun {
 public:
  InProcessRun(const std::string& task, const std::filesystem::path& out) : options_(Options(task, out)) {
    PreparedRun run = PrepareRun(options_);
    Announce(&run);
    for (const ComponentType& type : ComponentsOf(options_))
      components_.push_back(type.make(&bus_, run.options));
  }

  Bus& bus() { return bus_; }
  const std::vector<std::unique_ptr<Component>>& components() const { return components_; }
  // Starts episode 0.
  void Start() {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.seed = 1;
    command.required_component = RequiredComponents(options_);
    command.num_required = static_cast<int32_t>(command.required_component.size());
    command.required_instance.assign(command.required_component.size(), 0);
    bus_.Publish(channels::kCommand, command);
  }

 private:
  static RunOptions Options(const std::string& task, const std::filesystem::path& out) {
    RunOptions options;
    options.sim.task = task;
    options.in_process = true;
    options.out = out;
    return options;
  }

  RunOptions options_;
  Bus bus_{"memq://"};
  std::vector<std::unique_ptr<Component>> components_;
};

}  // namespace evalbus::runner
