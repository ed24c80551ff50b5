#include "report/web/web.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <thread>

#include "base/errors.h"
#include "base/realtime.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"
#include "bus/live_runs.h"
#include "bus/private_network.h"
#include "report/page/page.h"
#include "report/run_follower.h"
#include "report/web/board.h"
#include "report/web/web_jobs.h"
#include "results/found_runs.h"
#include "results/notes.h"
#include "results/run_folder.h"
#include "results/run_reader.h"
#include "viz/web/live_feed.h"
#include "viz/web/page.h"

namespace evalbus::report {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

constexpr int kUsualPort = 8080;
// Interval for finding new runs (kDiscover) and for reading folders (kLook), and maximum delay of messages
// (kMaxBatchDelay).
constexpr auto kDiscover = std::chrono::seconds(1);
constexpr auto kLook = std::chrono::milliseconds(200);
constexpr auto kBoardPeriod = std::chrono::seconds(1);
constexpr auto kMaxBatchDelay = std::chrono::milliseconds(10);
// The last messages of an episode may arrive this long after its line in episodes.jsonl.
constexpr auto kEndDelay = std::chrono::seconds(1);
// Maximum number of messages that are handled from one bus before the next bus has its turn.
constexpr int kInARow = 1000;
// Maximum length of the queue of received messages; more than a receive buffer holds.
constexpr int kMaxQueued = 100000;
constexpr size_t kMaxRuns = 1000;
// Time to wait for running jobs at the end. Short enough for Ctrl-C to end the server within two seconds.
constexpr std::chrono::seconds kStopping{1};

std::string TimeOfDay() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  return fmt::format("{:%H:%M:%S}", local);
}

// A run on the page: on disk, on a bus, or both.
class ShownRun {
 public:
  // found.folder: folder of a run, or a log that is being played; may be empty. source: the folder that the
  // user named.
  ShownRun(int number, results::FoundRun found, std::string source, std::string suffix,
           viz::UpdateBroadcaster* broadcaster, WebJobs* jobs)
      : number_(number),
        found_(std::move(found)),
        source_(std::move(source)),
        suffix_(std::move(suffix)),
        broadcaster_(broadcaster),
        jobs_(jobs) {
    if (!folder().empty() && !fs::is_regular_file(folder())) {
      follower_.emplace(folder());
      notes_.emplace(folder());
    }
    Publish();
  }

  const fs::path& folder() const { return found_.folder; }
  const std::string& source() const { return source_; }
  // Returns the run for the board; nullopt if run.json does not exist yet, or if another entry represents the
  // run on the board.
  std::optional<BoardRun> ForBoard() const {
    if (!follower_ || !follower_->info() || !suffix_.empty() || is_replaced_) return std::nullopt;
    return BoardRun{.number = number_,
                    .policy = policy(),
                    .source = source_,
                    .is_over = follower_->is_over(),
                    .planned = found_.planned,
                    .run = follower_->info(),
                    .stage_names = follower_->stage_names()};
  }
  // Returns true if the run has not begun.
  bool is_waiting() const { return follower_ && !follower_->info() && suffix_.empty() && !is_replaced_; }
  int planned() const { return found_.planned; }
  // Publishes whether a process evaluates into the run's folder, and whether the folder was removed, if this
  // has changed. Must be called about once a second.
  void UpdateActivity() {
    const bool is_active = follower_ && !follower_->is_over() && results::IsInUse(folder());
    std::error_code error;
    const bool is_gone =
        follower_ && follower_->info() && fs::status(folder(), error).type() == fs::file_type::not_found;
    if (is_active == is_active_ && is_gone == is_gone_) return;
    is_active_ = is_active;
    is_gone_ = is_gone;
    Publish();
  }
  // Must be called when other runs on the page contain its episodes.
  void SetReplaced() {
    if (std::exchange(is_replaced_, true)) return;
    broadcaster_->SetEpisodes(number_, 0, {});
    follower_.reset();
    Publish();
  }
  // Returns whether this entry shows the run in this folder. False after SetReplaced(): when shards are
  // merged, the folder of the replaced entry gets the merged run, which has a new entry.
  bool shows(const fs::path& path) const { return found_.folder == path && !is_replaced_; }
  bool has_bus() const { return bus_ != nullptr; }
  const std::string& url() const { return url_; }
  bool is_on(const LiveRun& run) const { return has_bus() && url_ == run.url; }

  void Attach(const LiveRun& run) {
    const results::RecordedRun* info = follower_ ? follower_->info() : nullptr;
    url_ = run.url;
    is_replay_ = run.is_replay;
    bus_ = std::make_unique<Bus>(run.url);
    feed_ =
        std::make_unique<viz::LiveFeed>(number_, info ? info->policy : "", info ? info->num_planned() : 0);
    for (const std::string_view channel : viz::LiveFeed::kChannels) {
      bus_->SubscribeRaw(std::string(channel),
                         [this](std::string_view name, std::span<const uint8_t> data, int64_t) {
                           feed_->Receive(name, data, steady_clock::now(), TimeOfDay());
                         });
    }
    bus_->SetMaxBatchDelay(kMaxBatchDelay);
    asked_model_.reset();
    asked_history_.reset();
    remark_.clear();
  }
  // Must be called when the run's processes have ended. Handles the messages that are still queued; received
  // data are kept.
  void Detach() {
    for (int i = 0; i < kMaxQueued && bus_->Handle(); ++i) {
    }
    bus_.reset();
    Publish();
  }
  void SetRemark(const std::string& remark) {
    if (remark_ != remark) Publish();
    remark_ = remark;
  }

  // Handles queued messages; returns false if there were none.
  bool Handle() {
    bool any = false;
    for (int i = 0; bus_ && i < kInARow && bus_->Handle(); ++i) any = true;
    return any;
  }
  void WaitForMessage(SteadyTime until) { bus_->Handle(until); }

  // Reads new data from the folder. Returns false if more data may be available. Sets has_changed if the
  // board must be computed again.
  bool Update(bool can_write_notes, bool* has_changed) {
    if (!follower_) return true;
    RunFollower::News news = follower_->Update();
    if (news.is_changed) Publish();
    *has_changed = *has_changed || news.is_changed;
    UpdateNotes(can_write_notes);
    const bool is_all = news.rows.size() < RunFollower::kLinesAtOnce;
    // If a run has several workers, only the first worker's entry has the list of episodes.
    if (suffix_.empty() && news.is_changed)
      broadcaster_->SetEpisodes(number_, news.from, std::move(news.rows));
    return is_all;
  }

  void Publish(SteadyTime now) {
    if (!feed_) {
      if (std::exchange(has_news_, false)) broadcaster_->SetRun(number_, viz::RunBlock(Numbers(), Label()));
      return;
    }
    RequestMissing();
    RequestLostEnd(now);
    std::vector<viz::EpisodeRow> done = feed_->TakeDone();
    if (!follower_) {
      for (viz::EpisodeRow& row : done) {
        row.has_track = false;  // the log is not stored
        broadcaster_->SetEpisodes(number_, broadcaster_->num_episodes(number_), {std::move(row)});
      }
    }
    const viz::RunNumbers counted = Numbers();
    feed_->Publish(broadcaster_, Label(), follower_ && follower_->info() ? &counted : nullptr, now);
  }

 private:
  void Publish() {
    has_news_ = true;
    const results::RecordedRun* info = follower_ ? follower_->info() : nullptr;
    jobs_->SetRun(number_, follower_ ? folder() : fs::path(), info ? policy() : "");
  }

  // Returns the name of the policy in its plan or, outside a plan, in run.json.
  std::string policy() const { return found_.policy.empty() ? follower_->info()->policy : found_.policy; }

  void UpdateNotes(bool can_write) {
    try {
      if (const auto notes = notes_->Update())
        broadcaster_->SetNotes(number_, viz::NotesBlock(number_, *notes, can_write));
    } catch (const InputError& error) {
      SetRemark(error.what());
    }
  }

  viz::RunNumbers Numbers() const {
    viz::RunNumbers numbers;
    if (follower_) numbers = follower_->numbers();
    return numbers;
  }

  viz::RunLabel Label() const {
    viz::RunLabel label;
    label.run = number_;
    label.name = folder().empty() ? url_ : found_.name;
    if (!suffix_.empty()) label.name += ", " + suffix_;
    if (is_replay_) label.name += ", replay";
    label.is_replaced = is_replaced_;
    if (follower_ && follower_->info()) label.policy = policy();
    label.is_live = has_bus() && !feed_->watch().is_over();
    label.is_active = is_active_;
    label.is_gone = is_gone_;
    if (is_gone_) label.remarks.push_back("the folder " + folder().string() + " no longer exists");
    if (follower_ && !follower_->error().empty()) label.remarks.push_back(follower_->error());
    if (!remark_.empty()) label.remarks.push_back(remark_);
    return label;
  }

  void RequestMissing() {
    if (const auto& model = feed_->model_without_scene(); model && asked_model_ != model) {
      asked_model_ = model;
      jobs_->RequestScene(model, follower_ ? folder() : fs::path(),
                          [this, model](viz::LiveFeed::Scene scene, const std::string& error) {
                            if (!error.empty()) SetRemark("no 3D view: " + error);
                            if (feed_) feed_->SetScene(model, std::move(scene));
                          });
    }
    const auto episode = feed_->episode_without_begin();
    if (!episode || (asked_history_ && asked_history_->episode == episode->episode &&
                     asked_history_->attempt == episode->attempt)) {
      return;
    }
    asked_history_ = episode;
    // A replay may differ from the log in the run's folder.
    if (!follower_ || is_replay_) return feed_->SetHistory(*episode, {});
    jobs_->RequestHistory(folder(), episode->episode, episode->tick - 1,
                          [this, episode](std::vector<viz::LiveFeed::Message> messages) {
                            if (feed_) feed_->SetHistory(*episode, messages);
                          });
  }

  // The messages at the end of an episode may be lost, and no new episode follows the last one.
  void RequestLostEnd(SteadyTime now) {
    const viz::EpisodeTrack* track = feed_->track();
    const results::RecordedRun* info = follower_ && !is_replay_ ? follower_->info() : nullptr;
    if (!info || !track || track->is_over() ||
        std::ranges::count(info->episodes, track->episode().episode, &results::RecordedEpisode::episode) ==
            0) {
      end_expected_at_.reset();
      return;
    }
    if (!end_expected_at_) end_expected_at_ = now + kEndDelay;
    if (now < *end_expected_at_) return;
    end_expected_at_ = SteadyTime::max();  // once
    jobs_->RequestHistory(folder(), track->episode().episode, 0,
                          [this, episode = track->episode()](const auto& messages) {
                            if (feed_) feed_->Complete(episode, messages);
                          });
  }

  const int number_;
  const results::FoundRun found_;
  const std::string source_, suffix_;
  viz::UpdateBroadcaster* const broadcaster_;
  WebJobs* const jobs_;
  std::optional<RunFollower> follower_;
  std::optional<results::NotesFollower> notes_;
  std::string url_;
  bool is_replay_ = false, has_news_ = true, is_replaced_ = false, is_active_ = false, is_gone_ = false;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<viz::LiveFeed> feed_;
  std::shared_ptr<const model_info_t> asked_model_;
  std::optional<header_t> asked_history_;
  // Time at which the end of the current episode is read from its log; nullopt while the episode is not in
  // episodes.jsonl.
  std::optional<SteadyTime> end_expected_at_;
  std::string remark_;
};

class WebPage {
 public:
  // can_write_notes: pages may add notes to run folders.
  WebPage(const WebOptions& options, bool can_write_notes, viz::UpdateBroadcaster* broadcaster, WebJobs* jobs)
      : options_(options), can_write_notes_(can_write_notes), broadcaster_(broadcaster), jobs_(jobs) {}

  // Finds the runs to show and joins their networks. Must be called while this process has only one thread.
  void Begin() {
    if (!options_.runs.empty() && !options_.url.empty()) {
      throw InputError("run folders cannot be combined with --url");
    }
    const std::vector<LiveRun> live = FindLiveRuns();
    if (!options_.runs.empty()) {
      for (const fs::path& run : options_.runs) CheckFolder(run, live);
      Discover(live);
    } else if (const std::string url = options_.url.empty() ? UrlOfEnvironment() : options_.url;
               !url.empty()) {
      LiveRun run;
      run.url = url;
      if (std::ranges::count(live, url, &LiveRun::url) == 1) run = ChooseLiveRun(live, url);
      folders_.push_back(run.folder);
      Attach(run, Add({run.folder, "", run.folder.empty() ? "" : NameOfRun(run.folder)}, "", ""));
    } else {
      // Workers of the same run count as one run.
      const bool is_one = !live.empty() && std::ranges::all_of(live, [&](const LiveRun& run) {
        return !run.folder.empty() && run.folder == live[0].folder;
      });
      const LiveRun run = is_one ? live[0] : ChooseLiveRun(live);
      folders_.push_back(run.folder);
      if (run.folder.empty()) {
        Attach(run, Add({}, "", ""));
      } else {
        Discover(live);
      }
    }
    if (is_board_old_) PublishBoard();
    board_at_ = {};  // the board of all lines follows without a pause
  }

  void Run(viz::WebServer* server) {
    SteadyTime discover_at = steady_clock::now() + kDiscover, look_at{}, publish_at{};
    while (!stop_requested()) {
      const auto now = steady_clock::now();
      if (now >= discover_at) {
        Discover(FindLiveRuns());
        discover_at = now + kDiscover;
      }
      if (now >= look_at) {
        bool is_all = true;
        for (const auto& run : runs_) is_all = run->Update(can_write_notes_, &is_board_old_) && is_all;
        // If more lines are available, they are read without a pause, but messages are handled in between.
        look_at = is_all ? now + kLook : now;
        if (is_board_old_ && (is_all ? now >= board_at_ : !has_board_)) {
          PublishBoard();
          if (!is_all) board_at_ = {};
        }
      }
      jobs_->DeliverAnswers();
      if (now >= publish_at) {
        for (const auto& run : runs_) run->Publish(now);
        server->Wake();
        publish_at = now + viz::LiveFeed::kTicksPeriod;
      }
      HandleMessages(std::min({publish_at, look_at, now + kMaxBatchDelay}));
    }
  }

  // Shows an error on a run's panel.
  void SetRemark(int run, const std::string& remark) {
    if (static_cast<size_t>(run) < runs_.size()) runs_[static_cast<size_t>(run)]->SetRemark(remark);
  }

 private:
  // The pause until the next board is at least 20 times the computation time of this one, so that a board
  // with many episodes does not occupy a processor.
  void PublishBoard() {
    const auto begin = steady_clock::now();
    std::vector<BoardRun> rows;
    board_facts_.waiting_runs = board_facts_.waiting_episodes = 0;
    for (const auto& run : runs_) {
      board_facts_.waiting_runs += run->is_waiting() ? 1 : 0;
      board_facts_.waiting_episodes += run->is_waiting() ? run->planned() : 0;
      if (std::optional<BoardRun> row = run->ForBoard()) rows.push_back(std::move(*row));
    }
    if (!rows.empty()) broadcaster_->SetBoard(BoardBlock(rows, board_facts_));
    has_board_ = !rows.empty();
    is_board_old_ = false;
    const auto end = steady_clock::now();
    board_at_ = end + std::max<steady_clock::duration>(kBoardPeriod, 20 * (end - begin));
  }

  void HandleMessages(SteadyTime until) {
    bool any = false;
    ShownRun* listening = nullptr;
    for (const auto& run : runs_) {
      if (!run->has_bus()) continue;
      any = run->Handle() || any;
      listening = run.get();
    }
    if (any) return;
    if (listening) {
      listening->WaitForMessage(until);
    } else {
      std::this_thread::sleep_until(until);
    }
  }

  // Adds a folder to follow; throws InputError if it contains nothing to show.
  void CheckFolder(const fs::path& folder, const std::vector<LiveRun>& live) {
    const bool is_known = results::IsEvaluation(folder) || !LiveRunsOf(live, folder).empty();
    if (!is_known && !options_.is_child) {
      throw InputError(folder.string() +
                       (fs::is_regular_file(folder) ? ": not the folder of a run, a suite or a plan, and no "
                                                      "replay of this file is active"
                        : fs::exists(folder)        ? ": not the folder of a run, a suite or a plan"
                                             : ": no such run folder" + results::SimilarFolder(folder)));
    }
    folders_.push_back(folder);
  }

  ShownRun* Add(const results::FoundRun& found, const std::string& source, const std::string& suffix) {
    runs_.push_back(std::make_unique<ShownRun>(static_cast<int>(runs_.size()), found, source, suffix,
                                               broadcaster_, jobs_));
    runs_.back()->Update(can_write_notes_, &is_board_old_);
    return runs_.back().get();
  }

  void Attach(const LiveRun& live, ShownRun* run) {
    try {
      if (live.other_network) JoinNetwork(live);
      run->Attach(live);
    } catch (const std::exception& error) {
      run->SetRemark(error.what());
    }
  }

  // Adds new runs of the folders, and follows the buses of active runs (a run with several workers has
  // several buses). Marks runs that other runs have replaced, and detaches runs from buses that have ended.
  void Discover(const std::vector<LiveRun>& live) {
    for (const fs::path& folder : folders_) {
      if (folder.empty()) continue;
      results::FoundRuns found;
      try {
        found = results::FindRuns(folder);
      } catch (const InputError&) {
        continue;  // suite.json is being written
      }
      const std::string source = folder.string();
      if (!found.baseline.empty()) {
        board_facts_.baseline = found.baseline;
        board_facts_.is_sequential = found.is_sequential;
        board_facts_.policies.insert(found.policies.begin(), found.policies.end());
        board_facts_.tasks.insert(found.tasks.begin(), found.tasks.end());
      }
      for (const results::FoundRun& run : found.runs) {
        if (runs_.size() >= kMaxRuns) continue;
        const auto is_same = [&](const auto& shown) { return shown->shows(run.folder); };
        if (std::ranges::none_of(runs_, is_same)) Add(run, source, "");
        FollowBuses(run, source, LiveRunsOf(live, run.folder));
      }
      for (const auto& shown : runs_) {
        const bool is_found = std::ranges::count(found.runs, shown->folder(), &results::FoundRun::folder) > 0;
        if (shown->source() != source || is_found) continue;
        shown->SetReplaced();
        is_board_old_ = true;
      }
    }
    for (const auto& run : runs_) {
      const bool is_there =
          std::ranges::any_of(live, [&](const LiveRun& other) { return run->is_on(other); });
      // A bus given by --url may belong to another machine, so it is kept.
      if (run->has_bus() && !is_there && !run->folder().empty()) run->Detach();
      run->UpdateActivity();
    }
  }

  void FollowBuses(const results::FoundRun& found, const std::string& source,
                   const std::vector<LiveRun>& live) {
    for (const LiveRun& bus : live) {
      ShownRun* free = nullptr;
      bool is_followed = false;
      int workers = 0;
      for (const auto& run : runs_) {
        if (!run->shows(found.folder)) continue;
        ++workers;
        is_followed = is_followed || run->is_on(bus);
        const bool is_gone =
            std::ranges::none_of(live, [&](const LiveRun& other) { return run->is_on(other); });
        if (!free && is_gone) free = run.get();
      }
      if (is_followed) continue;
      if (!free && runs_.size() < kMaxRuns) free = Add(found, source, fmt::format("worker {}", workers + 1));
      if (free) Attach(bus, free);
    }
  }

  const WebOptions& options_;
  const bool can_write_notes_;
  viz::UpdateBroadcaster* const broadcaster_;
  WebJobs* const jobs_;
  // Folders that the user named; an element is empty for a run without a folder.
  std::vector<fs::path> folders_;
  std::vector<std::unique_ptr<ShownRun>> runs_;
  BoardFacts board_facts_;
  bool is_board_old_ = false, has_board_ = false;
  SteadyTime board_at_{};
};

}  // namespace

void AnswerPage(const viz::WebTarget& target, WebJobs* jobs, viz::WebServer::Reply reply) {
  using Kind = viz::WebTarget::Kind;
  if (target.kind == Kind::kEpisode)
    return jobs->RequestEpisode(target.run, target.episode, std::move(reply));
  if (target.kind == Kind::kBlock) {
    viz::WebAnswer answer;
    answer.type = "application/octet-stream";
    answer.body = jobs->Block(target.name);
    answer.is_forever = true;
    return reply(answer.body ? answer : viz::WebAnswer::Text(404, "no such block"));
  }
  reply(viz::AnswerFile(target.kind == Kind::kPage ? "index.html" : target.name));
}

std::unique_ptr<viz::WebServer> ListenForPages(const std::string& host, std::optional<int> port,
                                               std::shared_ptr<viz::UpdateBroadcaster> broadcaster) {
  const auto listen = [&](int number) {
    return std::make_unique<viz::WebServer>(viz::WebServer::Address{host, static_cast<uint16_t>(number)},
                                            broadcaster);
  };
  if (port) {
    if (*port < 0 || *port > 65535)
      throw InputError(fmt::format("--port: expected 0 to 65535, got {}", *port));
    return listen(*port);
  }
  try {
    return listen(kUsualPort);
  } catch (const InputError&) {
    return listen(0);
  }
}

namespace {

// Returns the URL fragment of the episode that the page opens first; empty if no episode was chosen. Throws
// InputError.
std::string OpenedEpisode(const WebOptions& options) {
  if (!options.episode) return "";
  if (options.runs.size() != 1)
    throw InputError(fmt::format("--episode: expected one run, got {}", options.runs.size()));
  const results::RecordedRun run = results::ReadRun(options.runs.front());
  for (const results::RecordedEpisode& episode : run.episodes) {
    if (episode.episode == *options.episode) return PlayerUrl({0, episode.episode}, episode.cause);
  }
  std::vector<int> finished;
  for (const results::RecordedEpisode& episode : run.episodes) finished.push_back(episode.episode);
  throw InputError(fmt::format("--episode: {} has no finished episode {}{}", options.runs.front().string(),
                               *options.episode,
                               finished.empty() ? "" : "; its episodes are " + RangesText(finished)));
}

}  // namespace

int Web(const WebOptions& options) {
  const std::string opened = OpenedEpisode(options);
  LowerPriority();
  const auto broadcaster = std::make_shared<viz::UpdateBroadcaster>();
  InstallStopSignals();
  // The socket must be created before this process joins a run's network namespace, which browsers cannot
  // reach.
  const std::unique_ptr<viz::WebServer> server =
      options.is_child ? std::make_unique<viz::WebServer>(dup(STDIN_FILENO), broadcaster)
                       : ListenForPages(options.listen, options.port, broadcaster);
  WebJobs jobs;
  // Notes modify files of this user, so they are accepted only from this machine.
  const bool can_write_notes = server->is_loopback();
  WebPage page(options, can_write_notes, broadcaster.get(), &jobs);
  page.Begin();
  viz::WebServer::NoteHandler on_note;
  if (can_write_notes) {
    on_note = [&](viz::WebNote note) {
      const int run = note.run;
      jobs.RequestNote(std::move(note),
                       [&page, run](const std::string& error) { page.SetRemark(run, error); });
    };
  }
  server->Start([&jobs](const viz::WebTarget& target,
                        viz::WebServer::Reply reply) { AnswerPage(target, &jobs, std::move(reply)); },
                on_note);
  if (!options.is_child) fmt::print("page {}{}  (Ctrl-C ends it)\n", server->url(), opened);
  std::fflush(stdout);
  int code = 0;
  try {
    page.Run(server.get());
  } catch (const std::exception& error) {
    code = ReportError(error);
  }
  // Jobs that answer requests of the server may still be reading, for example from a disk that does not
  // respond. Neither `jobs` nor `server` may then be destroyed.
  server->Stop();
  if (!jobs.Stop(kStopping)) {
    std::fflush(stdout);
    _exit(code);
  }
  return code;
}

}  // namespace evalbus::report
