#include "runner/run_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/packed_log.h"
#include "policy_bridge/policies/demonstration.h"
#include "policy_bridge/policies/replay_policy.h"
#include "results/run_reader.h"

namespace evalbus::runner {

std::vector<std::string> ReadOlderOptions(const nlohmann::json& json, const std::string& file,
                                          RunOptions* options) {
  const RunOptions defaults;
  nlohmann::json all = OptionsJson(defaults);
  for (const char* always : {"task_path", "policy", "episodes", "seed", "control_hz"}) all.erase(always);
  // Runs from before this option existed used shared seeds.
  all["seed_stream"] = kSharedSeeds;
  std::vector<std::string> newer;
  ForEachOption(defaults, [&](const auto& row, const auto&) {
    if (row.help.empty() || !all.contains(row.key) || json.contains(row.key)) return;
    newer.push_back(fmt::format("{} {}", OptionName(row.key), ToText(all[row.key])));
  });
  if (json.is_object()) all.update(json);
  ReadOptions(json.is_object() ? all : json, file, options);
  return newer;
}

void FollowContract(bool rate_is_given, bool timeout_is_given, RunOptions* options) {
  const std::optional<policy::Contract> contract = policy::FindContractOf(options->policy);
  if (!contract) return;
  if (!rate_is_given) options->sim.control_hz = contract->rate_hz;
  // The policy enforces its own deadlines; the sim's timeout only detects a policy that hangs.
  const policy::Deadlines& deadlines = contract->deadlines;
  if (!timeout_is_given) {
    options->sim.policy_timeout_s = std::max(
        options->sim.policy_timeout_s, deadlines.connect_s + deadlines.first_reply_s + deadlines.return_s);
  }
  if (options->policy_name.empty()) options->policy_name = contract->name;
}

void FollowRecording(RunOptions* options) {
  namespace fs = std::filesystem;
  const std::string path = policy::RecordingPath(options->policy.policy);
  if (path.empty() || !fs::exists(path)) return;
  const fs::path run = fs::is_directory(path) ? fs::path(path) : RunFolderOf(path);
  if (!fs::exists(run / kRunJson)) return;
  const std::string recorded = results::ReadRunInfo(run).seed_stream;
  std::string& stream = options->sim.seed_stream;
  if (stream != kRunSeeds && stream != recorded) {
    throw InputError(fmt::format("--seed-stream: the recording {} has the starts of '{}', not '{}'",
                                 run.string(), recorded, stream));
  }
  stream = recorded;
}

void CheckPolicyName(const RunOptions& options) {
  if (Printable(options.policy_name) != options.policy_name)
    throw InputError("--policy-name: expected text without control characters");
}

void CheckRunOptions(const RunOptions& options, size_t num_tasks) {
  sim::CheckSimOptions(options.sim);
  CheckRanges(options);
  sim::CheckSeeds(options.sim.seed_stream, options.seed, options.episodes);
  ParseLogForm(options.recorder.log);
  if (options.resume && options.out.empty()) {
    throw InputError("--resume requires --out: the folder of the run to continue");
  }
  if (options.in_process && !options.url.empty())
    throw InputError("--in-process cannot be combined with --url");
  if (options.in_process && !options.sim.engine.empty())
    throw InputError(
        "--in-process cannot be combined with --engine: another MuJoCo requires its own process");
  if (options.by_hand &&
      (options.in_process || options.url.empty() || num_tasks > 1 || options.workers > 1)) {
    throw InputError(
        "--by-hand: expected one task, one worker, no --in-process, and the bus of the processes in --url or "
        "EVALBUS_URL, for example udpm://239.255.76.67:7667?ttl=0");
  }
  CheckPolicyName(options);
  if (options.workers > 1 && !options.url.empty()) {
    throw InputError("--workers cannot be combined with --url: each worker has its own bus");
  }
  if (options.sim.realtime && options.policy.latency != "none") {
    throw InputError(
        "--latency cannot be combined with --realtime: in real time, an inference takes its actual time");
  }
  if (options.policy.policy == policy::kExternalPolicy) {
    if (options.policy.latency != "none" || options.policy.execution != "synchronous") {
      throw InputError(
          "--latency and --execution do not apply to --policy lcm, which controls its own timing");
    }
    if (options.url.empty() || num_tasks > 1) {
      throw InputError(
          "--policy lcm: expected one task, one worker, no --in-process, and the bus of the policy in --url "
          "or EVALBUS_URL, for example udpm://239.255.76.67:7667?ttl=0");
    }
  } else {
    policy::FindPolicy(options.policy);
  }
  constexpr char kDemo[] = "demo:";
  if (const std::string& name = options.policy.policy; name.starts_with(kDemo)) {
    const std::string path = name.substr(sizeof kDemo - 1);
    const size_t demos = policy::DemonstrationFiles(path).size();
    if (static_cast<size_t>(options.episodes) > demos) {
      throw InputError(
          fmt::format("--episodes {}: {} holds {}; expected at most {}, because each episode replays one",
                      options.episodes, path, Plural(demos, "demonstration"), demos));
    }
  }
  if (const std::filesystem::path recording = policy::RecordingPath(options.policy.policy);
      std::filesystem::is_directory(recording)) {
    const auto check = [&](int episode) {
      if (std::filesystem::exists(EpisodeLog(recording, episode))) return;
      throw InputError(
          fmt::format("--policy: {} contains no episode {} to replay", recording.string(), episode));
    };
    for (const int episode : options.only) check(episode);
    for (int episode = 0; options.only.empty() && episode < options.episodes; ++episode) check(episode);
  }
  if (num_tasks > 1 && !options.url.empty()) {
    throw InputError("--url: expected one task; each run of a suite has its own bus");
  }
  for (const int episode : options.only) {
    if (episode < options.episodes) continue;
    throw InputError(fmt::format("--only {}: expected 0 to {}, since --episodes is {}", episode,
                                 options.episodes - 1, options.episodes));
  }
}

}  // namespace evalbus::runner
