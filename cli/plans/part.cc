#include "cli/plans/part.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <memory>
#include <numeric>
#include <thread>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/plural.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "cli/launch/job_pool.h"
#include "cli/launch/suite.h"
#include "cli/launch/workers.h"
#include "cli/plans/scratch.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

// A disk that is full may have room again.
constexpr auto kTryAgain = std::chrono::seconds(5);
constexpr auto kGiveUp = std::chrono::minutes(10);

// A run is known in its messages by its folder's name: the one that it will have.
fs::path MadeIn(const Chunk& chunk, const fs::path& scratch) {
  return scratch / chunk.name() / launch::FolderOfTask(chunk.task);
}

launch::Job JobOf(const Chunk& chunk, const fs::path& options, const fs::path& scratch) {
  std::vector<int> episodes(static_cast<size_t>(chunk.size()));
  std::iota(episodes.begin(), episodes.end(), chunk.first);
  launch::Job job{chunk.name(), launch::RunCommand(options), scratch / (chunk.name() + ".log")};
  job.command.insert(job.command.end(), {chunk.task, "--out", MadeIn(chunk, scratch).string(), "--resume",
                                         "--only", fmt::format("{}", fmt::join(episodes, ","))});
  return job;
}

// Clears the error of standard output: on a full disk a job waits until its results fit, and must not fail
// because lines of its log were lost.
void Say(const std::string& text) {
  fmt::print("{}\n", Printable(text));
  std::fflush(stdout);
  std::clearerr(stdout);
}

// Puts it there as soon as the disk has room.
void PutWhenThereIsRoom(const PlanFolder& folder, const Chunk& chunk, const fs::path& finished) {
  const auto give_up = std::chrono::steady_clock::now() + kGiveUp;
  for (bool is_said = false;; is_said = true) {
    try {
      return folder.Put(chunk, finished);
    } catch (const EnvironmentError& error) {
      if (stop_requested() || std::chrono::steady_clock::now() > give_up) throw;
      if (!is_said) Say(fmt::format("{}: {}: tries again", chunk.name(), error.what()));
      std::this_thread::sleep_for(kTryAgain);
    }
  }
}

// One chunk after another, `at_once` at a time; each in a pool of its own, so that one that fails takes no
// other with it.
class Chunks {
 public:
  Chunks(const PlanFolder& folder, std::vector<Chunk> chunks, int at_once)
      : folder_(folder), waiting_(chunks.rbegin(), chunks.rend()), at_once_(static_cast<size_t>(at_once)) {
    for (const PlannedPolicy& policy : folder.plan().policies) {
      const fs::path file = scratch_.path() / (policy.name + ".json");
      WriteWhole(file, ToText(OptionsJson(folder.plan().OptionsOf(policy)), 2) + "\n");
      options_[policy.name] = file;
    }
  }

  // False when there is nothing left to do.
  bool Poll() {
    while (running_.size() < at_once_ && !waiting_.empty()) Begin();
    for (auto running = running_.begin(); running != running_.end();) {
      running = Advance(&*running) ? running_.erase(running) : std::next(running);
    }
    return !running_.empty() || !waiting_.empty();
  }
  const std::vector<std::string>& failures() const { return failures_; }

 private:
  struct Running {
    Chunk chunk;
    std::unique_ptr<AtWork> at_work;
    std::unique_ptr<launch::JobPool> pool;
  };

  void Begin() {
    const Chunk chunk = waiting_.back();
    waiting_.pop_back();
    if (folder_.has(chunk)) return Say(chunk.name() + ": there before");
    std::vector<launch::Job> jobs = {JobOf(chunk, options_.at(chunk.policy), scratch_.path())};
    running_.push_back({chunk, std::make_unique<AtWork>(folder_, chunk),
                        std::make_unique<launch::JobPool>(
                            std::move(jobs), 1, [](const std::string& why) { Say("begun again: " + why); })});
  }

  // True where the chunk is over.
  bool Advance(Running* running) {
    const Chunk& chunk = running->chunk;
    const fs::path made = MadeIn(chunk, scratch_.path());
    try {
      running->at_work->Tell();
      running->pool->Poll();
      if (!running->pool->done()) return false;
      PutWhenThereIsRoom(folder_, chunk, made);
      SayFailed(folder_, chunk, "");
      Say(fmt::format("{}: {}", chunk.name(), Plural(chunk.size(), "episode")));
    } catch (const std::exception& error) {
      failures_.push_back(fmt::format("{}: {}", chunk.name(), error.what()));
      Say("error: " + failures_.back());
      try {
        SayFailed(folder_, chunk, error.what());
      } catch (const std::exception&) {
        // The disk that refuses is what has failed.
      }
    }
    running->pool.reset();
    std::error_code ignored;
    fs::remove_all(made, ignored);
    return true;
  }

  const PlanFolder& folder_;
  Scratch scratch_;
  std::map<std::string, fs::path> options_;  // by policy
  std::vector<Chunk> waiting_;               // the next one last
  size_t at_once_;
  std::vector<Running> running_;
  std::vector<std::string> failures_;
};

}  // namespace

void RunPart(const PlanFolder& folder, int part, int parts, int workers) {
  InstallStopSignals();
  const std::vector<Chunk> mine = ChunksOfPart(ChunksOf(folder.plan()), part, parts);
  Say(fmt::format("part {} of {}: {}", part, parts, Plural(mine.size(), "chunk")));
  Chunks chunks(folder, mine, workers);
  while (chunks.Poll() && !stop_requested()) std::this_thread::sleep_for(launch::kJobPoll);
  if (stop_requested()) throw EnvironmentError("stopped; the same command goes on");
  const std::vector<std::string>& failures = chunks.failures();
  if (failures.empty()) return;
  throw EnvironmentError(
      fmt::format("{} of {} chunks failed, the first: {}", failures.size(), mine.size(), failures[0]));
}

}  // namespace evalbus::plans
