// What a run is made with, as `evalbus run` takes it, run.json keeps it, and every process of the run starts
// from it.
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

namespace evalbus::launch {

struct RunOptions {
  // sim.task is the one of this run.
  sim::SimOptions sim;
  policy::PolicyOptions policy;
  RecorderOptions recorder;
  std::string policy_name;
  int episodes = 10;
  std::vector<int> only;
  int64_t seed = 0;
  // kRunSeeds, kCollectSeeds or kSharedSeeds.
  std::string seed_stream = kRunSeeds;
  // `until` of the plan, in a run of a plan that stops when its comparisons are decided; empty otherwise. The
  // number of episodes then depends on the results.
  std::string until;
  int workers = 1;
  std::string url;
  bool in_process = false;
  bool by_hand = false;
  std::vector<std::string> video;
  // Nobody is simulated: a source takes the place of sim and policy (`evalbus watch`).
  bool watch = false;

  // Not kept: what to run (TASK[/VARIATION], TASK/all, all, RoboEval's names); where to, empty for
  // runs/TASK-VARIATION-POLICY-DATE-TIME; whether to go on with the run that is there.
  std::vector<std::string> tasks;
  std::filesystem::path out;
  bool resume = false;
  // Not negative: so many rounds of a collection came before, which sums up itself; only what is new is told.
  int round = -1;
  // Whether to show it on a page (`evalbus web`), which then stays.
  bool web = false;
  // Not negative: this process is that worker of the run.
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
          Option{
              &RunOptions::policy_name, "policy_name",
              "what results, videos and comparisons call the policy, say a checkpoint; default: as --policy",
              Range{}, kFixed},
          Option{&RunOptions::episodes, "episodes", "number of episodes", Range{1, kMaxEpisodes}},
          Option{&RunOptions::only, "only", "of the episodes, counted from 0, run these only, with commas",
                 Range{0, kMaxEpisodes}},
          Option{&RunOptions::seed, "seed", "seed of the run; equal seeds give equal bits", Range{}, kFixed},
          Option{&RunOptions::seed_stream, "seed_stream", "", Range{}, kFixed},
          Option{&RunOptions::until, "until"},
          Option{&RunOptions::workers, "workers",
                 "episodes (of a suite: runs) at the same time; the same results", Range{1, 1024}},
          Option{&RunOptions::url, "url",
                 "bus, udpm://ADDRESS:PORT?ttl=0; default: that of EVALBUS_URL, else the first that works of "
                 "this\n"
                 "machine's multicast, a private network namespace, one process"},
          Option{&RunOptions::in_process, "in_process",
                 "all components in one process, without network; fastest"},
          Option{&RunOptions::by_hand, "by_hand",
                 "start no processes but say which: those that you start on --url are evaluated"},
          Option{&RunOptions::video, "video",
                 "cameras, with commas: record a video of each episode while the next one runs\n"
                 "('evalbus render' does it later); none: no videos, the default"},
          Option{&RunOptions::watch, "watch", "", Range{}, kFixed},
      },
      options, f);
}

// What people call the policy.
inline const std::string& PolicyName(const RunOptions& options) {
  return options.policy_name.empty() ? options.policy.policy : options.policy_name;
}

// Takes the options of a run.json that may be older than some of them: those are as where nobody names them,
// which is what every run was until there was such an option. Returns these, as on a command line. What was
// run (task, policy, episodes, seed, rate) must be there. Throws InputError.
std::vector<std::string> ReadOlderOptions(const nlohmann::json& json, const std::string& file,
                                          RunOptions* options);

// What a policy's contract says and the user does not: control rate, how long the sim waits for an action,
// the policy's name. Throws InputError.
void FollowContract(bool rate_is_given, bool timeout_is_given, RunOptions* options);

// Takes the stream of seeds of the run whose actions the policy replays, so that the episodes begin as they
// were recorded. Throws InputError.
void FollowRecording(RunOptions* options);

// Throws InputError for what is wrong whatever the task is; num_tasks: how many there are.
void CheckRunOptions(const RunOptions& options, size_t num_tasks);

}  // namespace evalbus::launch
