#include "plans/probe.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/scratch.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "runner/job_pool.h"
#include "runner/workers.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

uintmax_t Size(const fs::path& folder) {
  uintmax_t size = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) size += entry.file_size();
  }
  return size;
}

}  // namespace

Probe ProbePlan(const Plan& plan, int most) {
  Probe probe;
  const Scratch scratch;
  const int runs = plan.num_runs(), tried = std::min(runs, most);
  const auto policy_of = [&](int sample) -> const PlannedPolicy& {
    return plan.policies[static_cast<size_t>(sample) * plan.policies.size() / static_cast<size_t>(tried)];
  };
  // A server that cannot be reached is waited for, without other output.
  Plan sampled = plan;
  sampled.policies.clear();
  for (int i = 0; i < tried; ++i) sampled.policies.push_back(policy_of(i));
  const std::vector<std::string> servers = sampled.Servers();
  std::fflush(stdout);
  fmt::print(stderr, "running {}{}\n", Plural(tried, "trial episode"),
             servers.empty() ? ""
                             : Printable(fmt::format(", with {} {}; one that cannot be reached is waited for",
                                                     servers.size() == 1 ? "the server" : "the servers",
                                                     fmt::join(servers, ", "))));
  for (int i = 0; i < tried; ++i) {
    // Each sample has the next task, so that every task is sampled if there are enough samples.
    const PlannedPolicy& policy = policy_of(i);
    const std::string& task = plan.tasks[static_cast<size_t>(i) % plan.tasks.size()];
    runner::RunOptions options = plan.OptionsOf(policy);
    options.episodes = 1;
    const fs::path file = scratch.path() / "options.json", out = scratch.path() / std::to_string(i);
    WriteWhole(file, ToText(OptionsJson(options), 2) + "\n");
    runner::Job job{policy.name + " on " + task, runner::RunCommand(file), scratch.path() / "log"};
    job.command.insert(job.command.end(), {task, "--out", out.string()});
    const auto began = std::chrono::steady_clock::now();
    try {
      runner::JobPool pool({job}, 1, [](const std::string&) {});
      while (!pool.done()) {
        if (!pool.Poll()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
      const uintmax_t episode_bytes = Size(out / kEpisodesFolder);
      probe.bytes_per_episode += static_cast<double>(episode_bytes);
      probe.bytes_per_run += static_cast<double>(Size(out) - episode_bytes);
      probe.seconds_per_episode +=
          std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
      ++probe.episodes;
    } catch (const std::exception& error) {
      probe.problem = error.what();
    }
  }
  if (probe.episodes > 0) {
    probe.seconds_per_episode /= probe.episodes;
    probe.bytes_per_episode /= probe.episodes;
    probe.bytes_per_run /= probe.episodes;
  }
  return probe;
}

}  // namespace evalbus::plans
