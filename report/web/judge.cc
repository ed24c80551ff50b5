#include "report/web/judge.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"
#include "report/page/page.h"
#include "report/run_follower.h"
#include "report/web/web.h"
#include "report/web/web_jobs.h"
#include "results/blind_order.h"
#include "results/operator_results.h"
#include "results/verdicts.h"
#include "viz/viewer/block.h"
#include "viz/web/page.h"

namespace evalbus::report {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// kFollow: interval for reading the folder of an active run, and maximum delay of Ctrl-C.
constexpr std::chrono::milliseconds kFollow{200};
constexpr std::chrono::seconds kStopTimeout{1};

std::string NowUtc() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

// The episodes to judge in the order in which they are shown, and the verdicts on them.
class Judgment {
 public:
  Judgment(const JudgeOptions& options, WebJobs* jobs) : options_(options), jobs_(jobs) {
    if (options.runs.size() == 1) {
      // If a parent process started this one, its run may not have begun yet.
      if (!options.is_child) results::ReadRunInfo(options.runs[0]);
      follower_.emplace(options.runs[0]);
      return;
    }
    const results::RecordedRun a = results::ReadRun(options.runs[0]), b = results::ReadRun(options.runs[1]);
    auto pairs = results::EpisodesOfEqualSeeds(a, b);
    std::erase_if(pairs, [&](const auto& pair) { return !HasLog(0, pair.first) || !HasLog(1, pair.second); });
    for (const results::JudgedEpisode& item : results::BlindOrder(pairs, options.seed)) Add(item);
    other_run_ = {results::RunIdentity(b), results::RunIdentity(a)};
    if (items_.empty()) throw InputError("no pair of episodes with equal seeds has logs in both runs");
    ReadItemVerdicts();
    task_ = a.task;
    variation_ = a.variation;
  }

  // Adds episodes that have finished since the last call. Returns whether anything has changed.
  bool Follow() {
    if (!follower_) return false;
    const size_t before = items_.size();
    const bool was_over = is_over();
    RunFollower::News news;
    do {
      news = follower_->Update();
      for (const viz::EpisodeRow& row : news.rows) {
        const results::JudgedEpisode item{0, row.episode};
        if (row.has_track && std::ranges::count(items_, item, &Item::episode) == 0) Add(item);
      }
    } while (!news.rows.empty());
    if (items_.size() != before) ReadItemVerdicts();
    if (const results::RecordedRun* run = follower_->info()) {
      task_ = run->task;
      variation_ = run->variation;
    }
    return items_.size() != before || is_over() != was_over || news.is_changed;
  }

  // Writes a verdict that was given on the page.
  void Take(const viz::WebVerdict& given) {
    error_.clear();
    try {
      const auto index = static_cast<size_t>(given.episode);
      if (index >= items_.size()) throw InputError("there is no such episode");
      // Another process of this operator may have revealed the results.
      ReadItemVerdicts();
      if (is_done()) throw InputError("the results have already been revealed");
      Item& item = items_[index];
      const results::Verdict verdict = {.episode = item.episode.episode,
                                        .operator_name = options_.operator_name,
                                        .outcome = *results::ParseOutcome(given.outcome),
                                        .stages = given.stages,
                                        .rubric = given.rubric,
                                        .time = NowUtc(),
                                        .place = given.episode,
                                        .order_seed = order_seed(),
                                        .other_run = OtherRun(item)};
      results::WriteVerdict(FolderOf(item), verdict);
      item.verdict = verdict;
    } catch (const std::exception& failure) {
      error_ = fmt::format("The verdict was not saved: {}", Printable(failure.what()));
    }
  }

  size_t num_items() const { return items_.size(); }
  size_t num_judged() const {
    return static_cast<size_t>(
        std::ranges::count_if(items_, [](const Item& item) { return item.verdict.has_value(); }));
  }
  bool is_over() const { return !follower_ || (follower_->info() && follower_->is_over()); }
  bool is_done() const { return is_over() && !items_.empty() && num_judged() == num_items(); }

  // Must be called only if is_done().
  std::vector<std::string> Results() const {
    std::vector<results::JudgedRun> runs;
    for (const fs::path& folder : options_.runs) runs.push_back(results::ReadJudgedRun(folder));
    return results::JudgmentLines(runs);
  }

  // Returns the block "judge" of docs/viewer_data.md.
  std::string Block() const {
    viz::BlockWriter block("judge");
    ordered_json& head = block.head();
    head["operator"] = options_.operator_name;
    head["is_over"] = is_over();
    head["error"] = error_.empty() && follower_ ? follower_->error() : error_;
    ordered_json& verdicts = head["verdicts"] = ordered_json::array();
    for (const Item& item : items_) {
      ordered_json& json = verdicts.emplace_back();
      if (!item.verdict) continue;
      json = {{"outcome", Word(item.verdict->outcome)}, {"stages", nullptr}, {"rubric", nullptr}};
      if (item.verdict->stages) json["stages"] = *item.verdict->stages;
      if (item.verdict->rubric) json["rubric"] = *item.verdict->rubric;
    }
    head["results"] = nullptr;
    if (is_done()) {
      for (const std::string& line : Results()) head["results"].push_back(WithMinus(line));
    }
    return block.Bytes();
  }

  // Returns the block "run", without the names of policy and run, and without rates.
  std::string RunBlock() const {
    viz::RunNumbers numbers;
    numbers.task = task_;
    numbers.variation = variation_;
    numbers.is_over = false;
    return viz::RunBlock(numbers,
                         {.run = 0, .name = "Blind verdicts", .policy = "", .is_live = true, .remarks = {}});
  }

 private:
  struct Item {
    results::JudgedEpisode episode;
    std::optional<results::Verdict> verdict;
  };

  const fs::path& FolderOf(const Item& item) const {
    return options_.runs[static_cast<size_t>(item.episode.run)];
  }
  // Returns the identity of the run that is judged together with the item's run; empty for a single run.
  std::string OtherRun(const Item& item) const {
    return other_run_.empty() ? "" : other_run_[static_cast<size_t>(item.episode.run)];
  }
  bool HasLog(size_t run, int episode) const { return fs::exists(EpisodeLog(options_.runs[run], episode)); }
  std::optional<int64_t> order_seed() const {
    return options_.runs.size() == 2 ? std::optional(options_.seed) : std::nullopt;
  }

  void Add(const results::JudgedEpisode& episode) {
    jobs_->AddBlind(FolderOf(items_.emplace_back(Item{episode, std::nullopt})), episode.episode);
  }

  // Reads the verdicts that this operator has given, in this or in another process. Throws InputError.
  void ReadItemVerdicts() {
    std::vector<std::vector<results::Verdict>> verdicts;
    for (const fs::path& run : options_.runs) verdicts.push_back(results::ReadVerdicts(run));
    for (size_t place = 0; place < items_.size(); ++place) {
      Item& item = items_[place];
      item.verdict.reset();
      for (const results::Verdict& verdict : verdicts[static_cast<size_t>(item.episode.run)]) {
        if (verdict.episode != item.episode.episode || verdict.operator_name != options_.operator_name)
          continue;
        CheckOrder(verdict, item, static_cast<int>(place));
        item.verdict = verdict;
      }
    }
  }

  // Throws InputError unless the verdict was given in this order. A verdict on a run alone, or together with
  // another run, is not part of the random order of these two runs, and its results may have been revealed.
  void CheckOrder(const results::Verdict& verdict, const Item& item, int place) const {
    // Verdicts of older versions do not name the other run.
    const bool is_of_these = verdict.other_run.empty() || verdict.other_run == OtherRun(item);
    const bool is_of_order = verdict.order_seed == order_seed() && (!order_seed() || verdict.place == place);
    if (is_of_order && is_of_these) return;
    if (order_seed() && verdict.order_seed && verdict.order_seed != order_seed()) {
      throw InputError(fmt::format("--seed {}: {} has begun to judge in the order of --seed {}",
                                   options_.seed, options_.operator_name, *verdict.order_seed));
    }
    throw InputError(fmt::format(
        "--operator {}: episode {} of {} already has a verdict of this operator, from a judgment {}; use "
        "another name",
        options_.operator_name, verdict.episode, FolderOf(item).string(),
        !verdict.order_seed ? "of this run alone"
        : order_seed()      ? "with another run or in another order"
                            : "of two runs"));
  }

  const JudgeOptions& options_;
  WebJobs* const jobs_;
  // Follows the judged run; nullopt if two runs are judged.
  std::optional<RunFollower> follower_;
  // By run: identity of the other run. Empty if only one run is judged.
  std::vector<std::string> other_run_;
  std::string task_, variation_;
  std::vector<Item> items_;
  std::string error_;
};

// Queue of verdicts from the server's thread to the main thread.
class VerdictQueue {
 public:
  void Add(viz::WebVerdict verdict) {
    const std::lock_guard lock(mutex_);
    verdicts_.push_back(std::move(verdict));
    is_filled_.notify_one();
  }
  // Returns the verdicts received since the last call. If there are none, waits for one, at most for
  // `timeout`.
  std::vector<viz::WebVerdict> TakeAll(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    is_filled_.wait_for(lock, timeout, [this] { return !verdicts_.empty(); });
    return std::exchange(verdicts_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable is_filled_;
  std::vector<viz::WebVerdict> verdicts_;
};

void PrintResults(const Judgment& judgment) {
  for (const std::string& line : judgment.Results()) fmt::print("{}\n", line);
  std::fflush(stdout);
}

void ServeJudgment(Judgment* judgment, VerdictQueue* queue, viz::UpdateBroadcaster* broadcaster,
                   viz::WebServer* server) {
  bool is_changed = true, was_done = false;
  while (!stop_requested()) {
    if (is_changed) {
      broadcaster->SetRun(0, judgment->RunBlock());
      // The page of `evalbus judge` has no scoreboard. The block "judge" is sent in its place, before all
      // other blocks.
      broadcaster->SetBoard(judgment->Block());
      server->Wake();
    }
    if (judgment->is_done() && !std::exchange(was_done, true)) PrintResults(*judgment);
    const std::vector<viz::WebVerdict> verdicts = queue->TakeAll(kFollow);
    for (const viz::WebVerdict& verdict : verdicts) judgment->Take(verdict);
    is_changed = judgment->Follow() || !verdicts.empty();
  }
  if (was_done) return;
  fmt::print("verdicts on {} of {}; run the same command again to continue\n", judgment->num_judged(),
             Plural(static_cast<int64_t>(judgment->num_items()), "episode"));
}

}  // namespace

void Judge(const JudgeOptions& options) {
  results::CheckOperatorName(options.operator_name);
  const auto broadcaster = std::make_shared<viz::UpdateBroadcaster>();
  InstallStopSignals();
  WebJobs jobs;
  Judgment judgment(options, &jobs);
  judgment.Follow();
  if (judgment.is_done() && !options.is_child) return PrintResults(judgment);
  if (!options.is_child && judgment.is_over() && judgment.num_items() == 0)
    throw InputError(options.runs[0].string() + ": no finished episode has a log");
  VerdictQueue queue;
  const std::unique_ptr<viz::WebServer> server =
      options.is_child ? std::make_unique<viz::WebServer>(dup(STDIN_FILENO), broadcaster)
                       : ListenForPages("", options.port, broadcaster);
  server->Start([&jobs](const viz::WebTarget& target,
                        viz::WebServer::Reply reply) { AnswerPage(target, &jobs, std::move(reply)); },
                nullptr, [&queue](viz::WebVerdict verdict) { queue.Add(std::move(verdict)); });
  if (!options.is_child) fmt::print("page {}  (Ctrl-C ends it)\n", server->url());
  std::fflush(stdout);
  ServeJudgment(&judgment, &queue, broadcaster.get(), server.get());
  server->Stop();
  if (jobs.Stop(kStopTimeout)) return;
  // A job is still reading from a disk that does not respond. _exit() does not destroy the objects that it
  // uses.
  std::fflush(stdout);
  _exit(0);
}

bool HasJudgedAll(const fs::path& run, const std::string& operator_name) {
  std::set<int> judged;
  for (const results::Verdict& verdict : results::ReadVerdicts(run)) {
    if (verdict.operator_name == operator_name) judged.insert(verdict.episode);
  }
  return std::ranges::all_of(results::ReadRun(run).episodes, [&](const results::RecordedEpisode& episode) {
    return judged.contains(episode.episode) || !fs::exists(EpisodeLog(run, episode.episode));
  });
}

}  // namespace evalbus::report
