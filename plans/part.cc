#include "plans/part.h"

#include <fmt/format.h>

#include <chrono>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <thread>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/scratch.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "runner/job_pool.h"
#include "runner/suite.h"
#include "runner/workers.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

// Retry interval and time limit for copying a shard, for example to a full disk, on which space may become
// available.
constexpr auto kTryAgain = std::chrono::seconds(5);
constexpr auto kGiveUp = std::chrono::minutes(10);

// Returns the temporary folder of a shard's run. It already has the final name, because messages identify a
// run by this name.
fs::path MadeIn(const Shard& shard, const fs::path& scratch) {
  return scratch / shard.name() / FolderOfTask(shard.task);
}

runner::Job JobOf(const Shard& shard, const fs::path& options, const fs::path& scratch) {
  std::vector<int> episodes(static_cast<size_t>(shard.size()));
  std::iota(episodes.begin(), episodes.end(), shard.first);
  runner::Job job{shard.name(), runner::RunCommand(options), scratch / (shard.name() + ".log")};
  job.command.insert(job.command.end(), {shard.task, "--out", MadeIn(shard, scratch).string(), "--resume"});
  const std::vector<std::string> only = runner::OnlyOptions(episodes);
  job.command.insert(job.command.end(), only.begin(), only.end());
  return job;
}

// Prints a line and clears the error state of standard output. On a full disk, a job waits until its results
// fit, and must not fail because lines of its log were lost.
void PrintLine(const std::string& text) {
  fmt::print("{}\n", Printable(text));
  std::fflush(stdout);
  std::clearerr(stdout);
}

// Runs shards, `at_once` at a time. Each shard has its own job pool, so that a failed shard does not stop the
// others.
class Shards {
 public:
  Shards(const PlanFolder& folder, std::vector<Shard> shards, int at_once)
      : folder_(folder), waiting_(shards.rbegin(), shards.rend()), at_once_(static_cast<size_t>(at_once)) {
    for (const PlannedPolicy& policy : folder.plan().policies) {
      const fs::path file = scratch_.path() / (policy.name + ".json");
      WriteWhole(file, ToText(OptionsJson(folder.plan().OptionsOf(policy)), 2) + "\n");
      options_[policy.name] = file;
    }
  }

  // Returns false when all shards have finished or failed.
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
    Shard shard;
    std::unique_ptr<AtWork> at_work;
    std::unique_ptr<runner::JobPool> pool;
    // Set if the shard has finished, but could not be copied: when to try again, and when to give up.
    struct Retry {
      std::chrono::steady_clock::time_point next, give_up;
    };
    std::optional<Retry> retry{};
  };

  void Begin() {
    const Shard shard = waiting_.back();
    waiting_.pop_back();
    if (folder_.has(shard)) return PrintLine(shard.name() + ": already finished");
    std::vector<runner::Job> jobs = {JobOf(shard, options_.at(shard.policy), scratch_.path())};
    running_.push_back({shard, std::make_unique<AtWork>(folder_, shard),
                        std::make_unique<runner::JobPool>(std::move(jobs), 1, [](const std::string& why) {
                          PrintLine("retrying: " + why);
                        })});
  }

  // Copies a finished shard into the plan's folder. After an EnvironmentError, such as a full disk, returns
  // false and retries in later calls, at intervals of kTryAgain for up to kGiveUp. Does not sleep, because
  // the other shards must be polled.
  bool TryPut(Running* running, const fs::path& finished) {
    const auto now = std::chrono::steady_clock::now();
    std::optional<Running::Retry>& retry = running->retry;
    if (retry && now < retry->next) return false;
    try {
      folder_.Put(running->shard, finished);
      return true;
    } catch (const EnvironmentError& error) {
      if (!retry) {
        PrintLine(fmt::format("{}: {}: retrying", running->shard.name(), error.what()));
        retry.emplace(Running::Retry{.next = {}, .give_up = now + kGiveUp});
      }
      if (now > retry->give_up) throw;
      retry->next = std::chrono::steady_clock::now() + kTryAgain;
      return false;
    }
  }

  // Returns true when the shard has finished or failed.
  bool Advance(Running* running) {
    const Shard& shard = running->shard;
    const fs::path made = MadeIn(shard, scratch_.path());
    try {
      running->at_work->Refresh();
      running->pool->Poll();
      if (!running->pool->done() || !TryPut(running, made)) return false;
      WriteFailure(folder_, shard, "");
      PrintLine(fmt::format("{}: {}", shard.name(), Plural(shard.size(), "episode")));
    } catch (const std::exception& error) {
      // Errors of the shard's process begin with its name.
      std::string why = error.what();
      if (why.starts_with(shard.name() + ": ")) why.erase(0, shard.name().size() + 2);
      failures_.push_back(fmt::format("{}: {}", shard.name(), why));
      PrintLine("error: " + failures_.back());
      try {
        WriteFailure(folder_, shard, why);
      } catch (const std::exception&) {
        // The failure cannot be recorded, for example because the disk is full.
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
  std::vector<Shard> waiting_;               // the last entry runs next
  size_t at_once_;
  std::vector<Running> running_;
  std::vector<std::string> failures_;
};

}  // namespace

void RunPart(const PlanFolder& folder, int part, int parts, int workers) {
  folder.CheckNoneIsInterrupted();
  InstallStopSignals();
  const std::vector<Shard> mine = ShardsOfPart(ShardsOf(folder.plan()), part, parts);
  PrintLine(fmt::format("part {} of {}: {}", part, parts, Plural(mine.size(), "shard")));
  Shards shards(folder, mine, workers);
  while (shards.Poll() && !stop_requested()) std::this_thread::sleep_for(runner::kJobPoll);
  if (stop_requested()) throw EnvironmentError("stopped; run the same command again to resume");
  const std::vector<std::string>& failures = shards.failures();
  if (failures.empty()) return;
  throw EnvironmentError(
      fmt::format("{} of {} shards failed, the first: {}", failures.size(), mine.size(), failures[0]));
}

}  // namespace evalbus::plans
