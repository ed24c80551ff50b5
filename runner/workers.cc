#include "runner/workers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <thread>

#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"

namespace evalbus::runner {
namespace {

// Prefix of remarks in a worker's log.
constexpr std::string_view kRemark = "remark: ";

}  // namespace

void WorkerLog::OnRemark(const std::string& text) {
  fmt::print("{}{}\n", kRemark, Printable(text));
  std::fflush(stdout);
}

std::vector<std::string> RunCommand(const std::filesystem::path& options_file) {
  return {(Processes::BinaryFolder() / "evalbus").string(), "run", "--options", options_file.string()};
}

std::vector<std::string> OnlyOptions(const std::vector<int>& episodes) {
  constexpr size_t kInOneArgument = 10'000;
  std::vector<std::string> options;
  for (size_t first = 0; first < episodes.size(); first += kInOneArgument) {
    const auto begin = episodes.begin() + static_cast<std::ptrdiff_t>(first);
    const auto count = static_cast<std::ptrdiff_t>(std::min(kInOneArgument, episodes.size() - first));
    options.insert(options.end(), {"--only", fmt::format("{}", fmt::join(begin, begin + count, ","))});
  }
  return options;
}

std::vector<int> EpisodesOfWorker(const std::vector<int>& episodes, int worker, int workers) {
  std::vector<int> mine;
  for (const int episode : episodes) {
    if (episode % workers == worker) mine.push_back(episode);
  }
  return mine;
}

void EvaluateWorkers(const RunOptions& options, const results::RunFolder& folder, const RunPlan& plan,
                     RunListener* listener) {
  const auto pool = policy::OpenPool(options.policy, options.workers);
  std::vector<Job> jobs;
  for (int worker = 0; worker < options.workers; ++worker) {
    const std::vector<int> episodes = EpisodesOfWorker(plan.episodes, worker, options.workers);
    if (episodes.empty()) continue;
    const std::string name = fmt::format("worker-{}", worker);
    Job job{name, RunCommand(folder.path() / kRunJson), folder.log_file(name)};
    job.command.insert(job.command.end(), {"--worker", std::to_string(worker)});
    if (plan.is_selection) {
      const std::vector<std::string> only = OnlyOptions(episodes);
      job.command.insert(job.command.end(), only.begin(), only.end());
    }
    jobs.push_back(std::move(job));
  }
  EvaluateJobs(std::move(jobs), options.workers, folder, listener);
}

void EvaluateJobs(std::vector<Job> jobs, int at_once, const results::RunFolder& folder,
                  RunListener* listener) {
  // Skips episodes and remarks from before this call.
  results::EpisodeLines lines(folder.path() / kEpisodesJsonl);
  lines.Next();
  std::vector<results::NewLines> logs;
  for (const Job& job : jobs) logs.emplace_back(job.log_file).Next();
  JobPool pool(std::move(jobs), at_once,
               [&](const std::string& why) { listener->OnRemark("retrying: " + why); });
  while (!pool.done() && !stop_requested()) {
    if (!pool.Poll()) std::this_thread::sleep_for(kJobPoll);
    for (const auto& episode : lines.Next()) listener->OnEpisodeDone(episode);
    for (results::NewLines& log : logs) {
      for (const std::string& line : log.Next()) {
        if (line.starts_with(kRemark)) listener->OnRemark(line.substr(kRemark.size()));
      }
    }
    listener->Poll(std::chrono::steady_clock::now());
  }
}

}  // namespace evalbus::runner
