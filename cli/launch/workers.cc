#include "cli/launch/workers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <thread>

#include "base/run_layout.h"
#include "cli/launch/job_pool.h"
#include "sim/sim_options.h"

namespace evalbus::launch {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(20);
// Of a worker's log: its end, which the pool throws.
constexpr std::string_view kError = "error: ";

}  // namespace

void WorkerLog::OnRemark(const std::string& text) {
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

std::vector<std::string> RunCommand(const RunOptions& options) {
  std::vector<std::string> command = {(Processes::BinaryFolder() / "evalbus").string(),
                                      "run",
                                      "--policy",
                                      options.policy,
                                      "--episodes",
                                      std::to_string(options.episodes),
                                      fmt::format("--seed={}", options.seed)};
  const std::vector<std::string> sim = sim::SimArguments(options.sim);
  command.insert(command.end(), sim.begin(), sim.end());
  if (!options.only.empty()) {
    command.insert(command.end(), {"--only", fmt::format("{}", fmt::join(options.only, ","))});
  }
  if (options.in_process) command.push_back("--in-process");
  return command;
}

std::vector<int> EpisodesOfShare(const std::vector<int>& episodes, const std::string& share) {
  const size_t slash = share.find('/');
  const int index = std::stoi(share.substr(0, slash)), workers = std::stoi(share.substr(slash + 1));
  std::vector<int> mine;
  for (const int episode : episodes) {
    if (episode % workers == index) mine.push_back(episode);
  }
  return mine;
}

void EvaluateWorkers(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                     RunListener* listener) {
  results::EpisodeLines lines(folder.path() / kEpisodesJsonl);
  lines.Next();  // those that were there before
  std::vector<Job> jobs;
  std::vector<results::NewLines> logs;
  for (int i = 0; i < options.workers; ++i) {
    const std::string share = fmt::format("{}/{}", i, options.workers);
    if (EpisodesOfShare(plan.episodes, share).empty()) continue;
    logs.emplace_back(folder.log_file(fmt::format("worker-{}", i))).Next();
    Job job{fmt::format("worker-{}", i), RunCommand(options), folder.log_file(fmt::format("worker-{}", i))};
    job.command.insert(job.command.end(),
                       {options.sim.task, "--out", folder.path().string(), "--share", share});
    jobs.push_back(std::move(job));
  }
  JobPool pool(std::move(jobs), options.workers,
               [&](const std::string& why) { listener->OnRemark("begun again: " + why); });
  while (!pool.done() && !stop_requested()) {
    if (!pool.Poll()) std::this_thread::sleep_for(kPoll);
    for (const auto& episode : lines.Next()) listener->OnEpisodeDone(episode);
    for (results::NewLines& log : logs) {
      for (const std::string& line : log.Next()) {
        if (!line.starts_with(kError)) listener->OnRemark(line);
      }
    }
    listener->Poll(std::chrono::steady_clock::now());
  }
}

}  // namespace evalbus::launch
