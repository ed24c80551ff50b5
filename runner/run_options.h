// Options of a run. `evalbus run` parses them and stores them in run.json, and every process of the run reads
// them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "base/options.h"
#include "base/random.h"
#include "bus/recorder/recorder_options.h"
#include "policy_bridge/policy_options.h"
#include "sim/sim_options.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::runner {

struct RunOptions {
  // Options of the sim process, including the run's task (sim.task).
  sim::SimOptions sim;
  policy::PolicyOptions policy;
  RecorderOptions recorder;
  std::string policy_name;
  int episodes = 10;
  std::vector<int> only;
  int64_t seed = 0;
  // Value of `until` if the run belongs to a plan that stops when its comparisons are decided; otherwise
  // empty. If set, the number of episodes depends on the results.
  std::string until;
  int workers = 1;
  std::string url;
  bool in_process = false;
  bool by_hand = false;
  std::vector<std::string> video;
  // Renderer of a policy's images and of videos. run.json of a run with images contains the selected library.
  std::string gl = viz::kDefaultGl;
  // True for `evalbus watch`, where a source replaces sim and policy.
  bool watch = false;

  // The options below are not stored in run.json. tasks: tasks to run (TASK[/VARIATION], TASK/all, all,
  // RoboEval's names). out: output folder; empty for runs/TASK-VARIATION-POLICY-DATE-TIME. resume: continue
  // an existing run.
  std::vector<std::string> tasks;
  std::filesystem::path out;
  bool resume = false;
  // In a round of `evalbus collect`, the number of previous rounds; otherwise -1. The collection prints its
  // own summary, so a round reports only new episodes.
  int round = -1;
  // True if a page (`evalbus web`) should be served during the run and after it.
  bool web = false;
  // Name of the operator who judges the episodes of `evalbus watch` on a page (`evalbus judge`). The terminal
  // shows no results until all episodes are judged. Empty: no operator.
  std::string judged_by;
  // Index of this process if it is a worker of the run; -1 otherwise.
  int worker = -1;
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, RunOptions>
void ForEachOption(Options& options, const F& f) {
  constexpr bool kFixed = true;
  constexpr double kMaxEpisodes = 1e7;
  ForEachOption(options.sim, f);
  ForEachOption(options.policy, f);
  ForEachOption(options.recorder, f);
  ForEachRow(
      std::tuple{
          Option{&RunOptions::policy_name, "policy_name",
                 "name of the policy in results, videos and comparisons, for example a checkpoint; default: "
                 "--policy",
                 Range{}, kFixed},
          Option{&RunOptions::episodes, "episodes", "number of episodes", Range{1, kMaxEpisodes}},
          Option{&RunOptions::only, "only", "run only these episodes: numbers from 0, separated by commas",
                 Range{0, kMaxEpisodes}},
          Option{&RunOptions::seed, "seed", "seed of the run; equal seeds give bit-identical results",
                 Range{}, kFixed},
          Option{&RunOptions::until, "until"},
          Option{&RunOptions::workers, "workers",
                 "number of episodes (of a suite: runs) to run in parallel; does not change the results",
                 Range{1, 1024}},
          Option{&RunOptions::url, "url",
                 "bus, udpm://ADDRESS:PORT?ttl=0; default: the value of EVALBUS_URL, otherwise the first of "
                 "these that works:\nthis machine's multicast, a private network namespace, one process"},
          Option{&RunOptions::in_process, "in_process",
                 "run all components in one process, without network; fastest"},
          Option{&RunOptions::by_hand, "by_hand",
                 "start no processes, but print their commands: start them on --url yourself"},
          Option{&RunOptions::video, "video",
                 "cameras, separated by commas: record a video of each episode while the next one "
                 "runs\n('evalbus render' can make it later); none: no videos (default)"},
          Option{&RunOptions::gl, "gl", viz::kGlHelp, Range{}, kFixed},
          Option{&RunOptions::watch, "watch", "", Range{}, kFixed},
      },
      options, f);
}

// Returns the display name of the policy.
inline const std::string& PolicyName(const RunOptions& options) {
  return options.policy_name.empty() ? options.policy.policy : options.policy_name;
}

// Reads the options of a run.json. Options that are missing because the file is older get their default
// values, except for the seed stream, which is then kSharedSeeds. Returns the missing options that --help
// lists, in command-line syntax. Task, policy, episodes, seed and rate must be present. Throws InputError.
std::vector<std::string> ReadOlderOptions(const nlohmann::json& json, const std::string& file,
                                          RunOptions* options);

// Sets options from the policy's contract if the user did not set them: control rate, policy's name, and the
// sim's timeout for an action, which is only increased. Throws InputError.
void FollowContract(bool rate_is_given, bool timeout_is_given, RunOptions* options);

// If the policy replays a run, sets the seed stream to that run's seed stream, so that the episodes begin as
// recorded. Throws InputError.
void FollowRecording(RunOptions* options);

// Throws InputError if the policy's name has control characters, which terminals would execute.
void CheckPolicyName(const RunOptions& options);

// Checks all options that do not depend on the task. Throws InputError.
void CheckRunOptions(const RunOptions& options, size_t num_tasks);

}  // namespace evalbus::runner
