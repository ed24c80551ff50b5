#include "runner/run_json.h"

#include <mujoco/mujoco.h>

#include <set>
#include <string_view>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/plugins.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/text.h"
#include "lcmtypes/clock.h"
#include "models/randomized_model.h"
#include "models/task_description.h"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/policy_options.h"
#include "results/circumstances.h"
#include "runner/engines.h"
#include "runner/run_controller.h"
#include "runner/version.h"
#include "viz/images/painter/painter.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Returns the SHA-256 of each plugin by file name; null if there are no plugins.
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
  return {{"schema_version", kRunSchemaVersion},
          {"task", prepared.task.name},
          {"variation", prepared.variation},
          {"task_sha256", model_hashes.task_sha256},
          {"robot_sha256", Sha256File(prepared.robot.file)},
          {"physics_sha256", model_hashes.physics_sha256},
          {"visual_sha256", model_hashes.visual_sha256},
          {"limits_sha256",
           model_hashes.limits_sha256.empty() ? ordered_json() : ordered_json(model_hashes.limits_sha256)},
          {"evalbus_version", kVersion},
          {"git_commit", kGitCommit},
          {"git_dirty", kGitDirty},
          {"plugins", PluginsJson()},
          {"mujoco_version", mj_versionString()}};
}

// Returns the task for the command line: the name of a built-in task, or the file of any other task.
std::string TaskWord(const ordered_json& json) {
  const fs::path path = json.value("task_path", "");
  const fs::path file = IsTaskFile(path.parent_path()) ? path.parent_path() : path;
  const bool is_built_in = file.lexically_normal().string().starts_with(TasksFolder().string());
  if (!is_built_in && fs::exists(file)) return path.string();
  return json.value("task", "") + "/" + json.value("variation", "");
}

// Returns true if the robot's file has the same name as the file of the task's default robot.
bool IsTasksRobot(const std::string& task, const fs::path& robot) {
  try {
    return FindTask(task).task.robot_file.filename() == robot.filename();
  } catch (const InputError&) {
    return false;
  }
}

// Keys that are omitted from the list of options, because they do not change the results or are handled
// separately.
const std::set<std::string_view> kNotInCommand = {"task_path", "robot",      "policy",  "episodes", "seed",
                                                  "url",       "in_process", "by_hand", "workers",  "log"};

std::string Absolute(const fs::path& file) { return fs::absolute(file).lexically_normal().string(); }

}  // namespace

ordered_json RunFacts(const sim::PreparedScene& prepared, const RunOptions& options) {
  ordered_json facts = SceneFacts(prepared);
  const auto contract = policy::FindContractOf(options.policy);
  facts["policy_contract"] = contract ? policy::ContractJson(*contract) : ordered_json();
  const auto choices = ParameterChoices(prepared.task.variation(prepared.variation));
  if (!choices.empty()) facts[results::kParameterChoices] = choices;
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

std::string CommandOf(const ordered_json& run_json) {
  if (run_json.contains("source") || run_json.value("watch", false)) return "";
  const std::string task = TaskWord(run_json);
  std::vector<std::string> words = {"evalbus", "run", task};
  const auto text = [](const ordered_json& value) {
    return value.is_string() ? value.get<std::string>() : ToText(value);
  };
  for (const char* always : {"policy", "episodes", "seed"}) {
    if (run_json.contains(always)) words.insert(words.end(), {OptionName(always), text(run_json[always])});
  }
  if (const std::string robot = run_json.value("robot", ""); !robot.empty() && !IsTasksRobot(task, robot)) {
    words.insert(words.end(), {"--robot", robot});
  }
  const RunOptions defaults;
  const ordered_json usual = OptionsJson(defaults);
  ForEachOption(defaults, [&](const auto& row, const auto&) {
    const auto found = run_json.find(row.key);
    if (row.help.empty() || kNotInCommand.contains(row.key) || found == run_json.end()) return;
    if (*found == usual[row.key] || found->is_null()) return;
    if (found->is_boolean()) {
      words.push_back(OptionName(row.key));
    } else if (found->is_array()) {
      for (const ordered_json& element : *found)
        words.insert(words.end(), {OptionName(row.key), text(element)});
    } else {
      words.insert(words.end(), {OptionName(row.key), text(*found)});
    }
  });
  return ShellWords(words);
}

}  // namespace evalbus::runner
