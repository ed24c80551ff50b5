#include "runner/run_json.h"

#include <mujoco/mujoco.h>

#include "base/options_json.h"
#include "base/plugins.h"
#include "base/sha256.h"
#include "lcmtypes/clock.h"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/policy_options.h"
#include "runner/engines.h"
#include "runner/run_controller.h"
#include "runner/version.h"
#include "viz/images/painter/painter.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// SHA-256 of each plugin by file name; null without plugins.
ordered_json PluginsJson() {
  ordered_json plugins;
  for (const char* variable : {kPredicatePlugins, kPolicyPlugins}) {
    for (const fs::path& plugin : PluginsOf(variable))
      plugins[plugin.filename().string()] = Sha256File(plugin);
  }
  return plugins;
}

ordered_json SceneFacts(const sim::PreparedScene& prepared) {
  const ModelHashes model_hashes = ModelHashes::Of(prepared.info);
  return {{"task", prepared.task.name},
          {"variation", prepared.variation},
          {"task_sha256", model_hashes.task_sha256},
          {"robot_sha256", Sha256File(prepared.robot.file)},
          {"physics_sha256", model_hashes.physics_sha256},
          {"visual_sha256", model_hashes.visual_sha256},
          {"evalbus_version", kVersion},
          {"git_commit", kGitCommit},
          {"git_dirty", kGitDirty},
          {"plugins", PluginsJson()},
          {"mujoco_version", mj_versionString()}};
}

std::string Absolute(const fs::path& file) { return fs::absolute(file).lexically_normal().string(); }

}  // namespace

ordered_json RunFacts(const sim::PreparedScene& prepared, const RunOptions& options) {
  ordered_json facts = SceneFacts(prepared);
  const auto contract = policy::FindContractOf(options.policy);
  facts["policy_contract"] = contract ? policy::ContractJson(*contract) : ordered_json();
  facts["mujoco_version"] = EngineVersion(options.sim.engine);
  facts["painter"] = viz::MujocoPaints() ? "mujoco" : "evalbus";
  return facts;
}

ordered_json RunJson(const ordered_json& facts, const RunOptions& options) {
  ordered_json json = facts;
  json.update(OptionsJson(options));
  return json;
}

ordered_json ScoredRunJson(const sim::PreparedScene& prepared, const fs::path& map, const fs::path& data,
                           const std::vector<fs::path>& files) {
  ordered_json names = ordered_json::array();
  for (const fs::path& file : files) names.push_back(Absolute(file));
  ordered_json json = SceneFacts(prepared);
  json.update({{"robot", prepared.robot.file.string()},
               {"policy", data.filename().string()},
               {"seed", 0},
               {"episodes", files.size()},
               {"control_hz", 1 / ControlPeriod(prepared.info)},
               {"realtime", false},
               {"source", "file"},
               {"map", Absolute(map)},
               {"files", names}});
  return json;
}

}  // namespace evalbus::runner
