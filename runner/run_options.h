// Options of a run: parsed by `evalbus run`, stored in run.json, and read by every process of the run.
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
  // sim.task is the task of this run.
  sim::SimOptions sim;
  policy::PolicyOptions policy;
  RecorderOptions recorder;
  std::string policy_name;
  int episodes = 10;
  std::vector<int> only;
  int64_t seed = 0;
  // `until` of the plan, in a run of a plan that stops when its comparisons are decided; empty otherwise. The
  // number of episodes then depends on the results.
  std::string until;
  int workers = 1;
  std::string url;
  bool in_process = false;
  bool by_hand = false;
  std::vector<std::string> video;
  // Renderer of a policy's images and of videos. run.json has the library that "auto" has selected.
  std::string gl = viz::kDefaultGl;
  // A source replaces sim and policy (`evalbus watch`).
  bool watch = false;

  // The options below are not stored in run.json. tasks: what to run (TASK[/VARIATION], TASK/all, all,
  // RoboEval's names). out: output folder; empty for runs/TASK-VARIATION-POLICY-DATE-TIME. resume: continue
  // an existing run.
  std::vector<std::string> tasks;
  std::filesystem::path out;
  bool resume = false;
  // Number of previous rounds, in a round of a collection; -1 otherwise. The collection prints its own
  // summary, so that a round reports only new episodes.
  int round = -1;
  // Serve a page (`evalbus web`) that remains after the run.
  bool web = false;
  // Name of the operator who judges the episodes of a watch on a page (`evalbus judge`); until all are
  // judged, the terminal shows no results. Empty: none.
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
                 "bus, udpm://ADDRESS:PORT?ttl=0; default: that of EVALBUS_URL, otherwise the first that "
                 "works:\nthis machine's multicast, a private network namespace, one process"},
          Option{&RunOptions::in_process, "in_process",
                 "all components in one process, without network; fastest"},
          Option{&RunOptions::by_hand, "by_hand",
                 "start no processes, but print their commands: start them on --url yourself"},
          Option{&RunOptions::video, "video",
                 "cameras, separated by commas: record a video of each episode while the next one runs\n"
                 "('evalbus render' does it later); none: no videos (default)"},
          Option{&RunOptions::gl, "gl", viz::kGlHelp, Range{}, kFixed},
          Option{&RunOptions::watch, "watch", "", Range{}, kFixed},
      },
      options, f);
}

// Display name of the policy.
inline const std::string& PolicyName(const RunOptions& options) {
  return options.policy_name.empty() ? options.policy.policy : options.policy_name;
}

// Reads the options of a run.json. Options that are missing because the file is older get their default
// values; returns these options, in command-line syntax. Task, policy, episodes, seed and rate must be
// present. Throws InputError.
std::vector<std::string> ReadOlderOptions(const nlohmann::json& json, const std::string& file,
                                          RunOptions* options);

// Sets options from the policy's contract if the user did not set them: control rate, the sim's timeout for
// an action, the policy's name. Throws InputError.
void FollowContract(bool rate_is_given, bool timeout_is_given, RunOptions* options);

// If the policy replays a run, sets the seed stream of that run, so that the episodes start as recorded.
// Throws InputError.
void FollowRecording(RunOptions* options);

// Checks everything that does not depend on the task; num_tasks: number of tasks. Throws InputError.
void CheckRunOptions(const RunOptions& options, size_t num_tasks);

}  // namespace evalbus::runner
