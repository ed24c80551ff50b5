#include "results/comparability.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "lcmtypes/end_reason.h"
#include "results/rescorer.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Keys of run.json that MadeDifferently() ignores: they do not affect the compared values, are checked by
// CheckComparable(), or identify the policy or the episodes. All other keys may affect the values, including
// keys of newer versions.
constexpr std::string_view kChangesNothing[] = {
    "run_id",      "task",      "variation",      "task_path",     "task_sha256",    "robot",
    "model_path",  "assets",    "control_hz",     "policy",        "policy_name",    "seed",
    "episodes",    "only",      "workers",        "url",           "in_process",     "by_hand",
    "video",       "git_dirty", "physics_sha256", "visual_sha256", "contract",       "log",
    "seed_stream", "until",     "engine",         "trained_on",    "contract_sha256"};

// Returns true if an episode of the run ended because the policy exceeded its timeout.
bool HasPolicyTimeout(const RecordedRun& run) {
  return std::ranges::any_of(run.episodes, [](const RecordedEpisode& episode) {
    return episode.end_reason == end_reason::kPolicyTimeout;
  });
}

// Maximum number of differing contract members to list.
constexpr size_t kMaxContractWords = 4;
std::vector<std::string> ContractDifferences(const ordered_json& contract, const ordered_json& other) {
  std::vector<std::string> differences;
  for (const Difference& one : Differences(contract, other)) {
    if (one.name != "name")
      differences.push_back(fmt::format("{} {} against {}", one.name, one.before, one.after));
  }
  if (differences.size() > kMaxContractWords) {
    const size_t more = differences.size() - kMaxContractWords;
    differences.resize(kMaxContractWords);
    differences.push_back(fmt::format("{} more in run.json", more));
  }
  return differences;
}

}  // namespace

void CheckComparable(const RecordedRun& run, const RecordedRun& baseline) {
  const auto value = [](const RecordedRun& of, const char* key) {
    const auto found = of.info.find(key);
    if (found == of.info.end()) {
      throw InputError((of.folder / kRunJson).string() + ": no \"" + key +
                       "\", without which this run cannot be compared");
    }
    return *found;
  };
  const ordered_json rate = value(run, "control_hz"), baseline_rate = value(baseline, "control_hz");
  if (rate != baseline_rate) {
    const auto shown = [](const ordered_json& hz) {
      return hz.is_number() ? fmt::format("{:.5g}", hz.get<double>()) : hz.dump();
    };
    throw InputError(
        fmt::format("{} ran at {} Hz and {} at {} Hz: values depend on the control rate, so these runs "
                    "cannot be compared",
                    run.name, shown(rate), baseline.name, shown(baseline_rate)));
  }
  for (const auto& [key, what] : {std::pair("task_sha256", "descriptions of the task"),
                                  {"physics_sha256", "physics models (scene, robot or physics step)"}}) {
    if (value(run, key) == value(baseline, key)) continue;
    throw InputError(fmt::format("{} and {} were made with different {}, so these runs cannot be compared",
                                 run.name, baseline.name, what));
  }
}

void CheckSameEngine(const std::vector<const RecordedRuns*>& runs) {
  const RecordedRun* first = nullptr;
  for (const RecordedRuns* folder : runs) {
    for (const RecordedRun& run : folder->runs) {
      if (run.engine().empty()) continue;
      if (!first) first = &run;
      if (run.engine() == first->engine()) continue;
      throw InputError(
          fmt::format("{} was simulated by MuJoCo {} and {} by MuJoCo {}: success rates change with the "
                      "version; 'evalbus compare --across-engines' compares them anyway",
                      first->folder.string(), first->engine(), run.folder.string(), run.engine()));
    }
  }
}

std::string MadeDifferently(const RecordedRun& run, const RecordedRun& baseline) {
  std::string differences;
  const auto add = [&](const std::string& words) {
    differences += (differences.empty() ? "" : ", ") + words;
  };
  for (const auto& [key, value] : run.info.items()) {
    const auto other = baseline.info.find(key);
    if (std::ranges::find(kChangesNothing, key) != std::end(kChangesNothing) ||
        other == baseline.info.end() || *other == value) {
      continue;
    }
    // A run without "renderer" rendered nothing.
    if (key == "gl" && !(run.info.contains("renderer") && baseline.info.contains("renderer"))) continue;
    // A timeout that was never exceeded changes nothing.
    if (key == "policy_timeout_s" && !HasPolicyTimeout(run) && !HasPolicyTimeout(baseline)) continue;
    // The hash identifies the limits; paths may differ between machines.
    if (key == "limits" && run.info.contains("limits_sha256") && baseline.info.contains("limits_sha256"))
      continue;
    if (key != "policy_contract") {
      add(fmt::format("{} {} against {}", key, ToText(value), ToText(*other)));
    } else if (value.is_object() && other->is_object()) {  // otherwise the policies' names differ
      for (const std::string& words : ContractDifferences(value, *other)) add("contract: " + words);
    }
  }
  return differences;
}

}  // namespace evalbus::results
