// Implements `evalbus replay`, which plays recorded episodes on the bus to a new metrics process, and
// compares the scores.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/find_program.h"
#include "base/options.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/host.h"
#include "bus/live_runs.h"
#include "bus/private_network.h"
#include "bus/wait.h"
#include "cli/commands/commands.h"
#include "lcmtypes/clock.h"
#include "results/episode_json.h"
#include "results/episode_logs.h"
#include "results/rescorer.h"
#include "runner/live_view.h"
#include "runner/processes.h"
#include "runner/web_child.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

struct ReplayOptions {
  std::filesystem::path recording;
  // Episodes of a run to play; empty: all episodes.
  std::vector<int> episodes;
  // Playback speed in simulated seconds per second.
  double speed = 1;
  // Bus to use; empty: chosen as for `evalbus run`.
  std::string url;
  bool web = false;
};

// Maximum time for which the player may wait between two events.
constexpr double kLongestWait = 60;  // s
constexpr Range kSpeeds{0.001, 1e6};
constexpr auto kTick = std::chrono::milliseconds(20);
// Time to listen for other components, which publish STATUS more often than this.
constexpr auto kListen = std::chrono::milliseconds(700);
constexpr auto kMetricsStart = std::chrono::seconds(10);
// Timeouts for a score after the player has ended. kSettle is longer than the time for which metrics waits
// for late ticks.
constexpr auto kSettle = std::chrono::milliseconds(1500);
constexpr auto kOverdue = std::chrono::seconds(10);

fs::path FindPlayer() {
  if (fs::path program = FindProgram("lcm-logplayer"); !program.empty()) return program;
  throw EnvironmentError("lcm-logplayer is not in PATH; fix: apt-get install liblcm-bin");
}

// Channels that metrics, viz and monitors need. The recorded scores are not played, because the new metrics
// process publishes its own scores. COMMAND is not played, because there is no sim.
constexpr std::array<std::string_view, 5> kPlayedChannels = {
    channels::kModel.name, channels::kEpisodeBegin.name, channels::kState.name, channels::kContacts.name,
    channels::kEpisodeEnd.name};

std::string PlayedChannels() { return fmt::format("({})", fmt::join(kPlayedChannels, "|")); }

// Throws InputError if the log contains a wait longer than kLongestWait. LCM's player waits between events
// for the time that passed on the run's clock. In a real-time run, this clock may have been set, or may have
// advanced while the machine was suspended.
void CheckWaits(const fs::path& log, double speed) {
  EventLogReader reader(log);
  std::optional<int64_t> last_us;
  for (LogEvent event; reader.Next(&event);) {
    if (std::ranges::find(kPlayedChannels, event.channel) == kPlayedChannels.end()) continue;
    const double wait = last_us ? static_cast<double>(event.time_us - *last_us) * 1e-6 / speed : 0;
    last_us = event.time_us;
    if (wait <= kLongestWait) continue;
    throw InputError(
        fmt::format("{}: its clock jumps ahead, for which LCM's player would wait {:.0f} s at --speed {:g}; "
                    "use a higher --speed, or 'evalbus rescore', which does not wait",
                    log.string(), wait, speed));
  }
}

// A file in memory, for a program's output or an unpacked log. It disappears when this process ends, even if
// it is killed.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("log", MFD_CLOEXEC)) {
    if (fd_ < 0) throw EnvironmentError(std::string("memfd_create: ") + std::strerror(errno));
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  // path() is valid in this process and, until they call exec(), in its children. path_from_outside() is
  // valid in all processes of this user.
  fs::path path() const { return "/proc/self/fd/" + std::to_string(fd_); }
  fs::path path_from_outside() const { return fmt::format("/proc/{}/fd/{}", getpid(), fd_); }

 private:
  int fd_;
};

runner::LiveHeader Header(const fs::path& log, const results::RescoredEpisode& first, int episodes) {
  const model_info_t& model = *first.model;
  runner::LiveHeader header;
  header.task = model.task;
  header.variation = model.variation;
  header.policy = "recorded";
  header.clock = model.clock;
  header.control_hz = 1 / ControlPeriod(model);
  header.seed = first.summary.seed;
  header.episodes = episodes;
  // Facts that only run.json contains are taken from there.
  if (const auto run = results::RunOf(log)) {
    header.policy = run->policy;
    header.seed = run->seed;
  }
  return header;
}

// Plays logs. Publishes STATUS as the component "replay", by which monitors recognize a replay.
class Player : public Component {
 public:
  Player(const ReplayOptions& options, Bus* bus, runner::LiveView* view)
      : Component(bus, "replay"), options_(options), view_(view), program_(FindPlayer()) {
    bus->Subscribe(channels::kStatus, [this](const component_status_t& status) {
      metrics_heard_ |= status.component == "metrics";
      sim_heard_ |= status.component == "sim";
    });
    bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
      if (!EnterEpisode(begin)) return;
      PublishReady();
      view_->OnEpisodeBegin(begin);
    });
    bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& partial) {
      Progress(partial.header);
      view_->OnPartial(partial);
    });
    bus->Subscribe(channels::kEpisodeSummary, [this](const episode_summary_t& summary) { score_ = summary; });
    bus->Subscribe(channels::kRunSummary, [this](const run_summary_t& run) { OnScore(run); });
    bus->SetMaxBatchDelay(std::chrono::milliseconds(3));
  }

  // Starts the metrics process. Throws InputError if the user selected a bus on which a run or replay is
  // active, and EnvironmentError if metrics does not start.
  void Start(bool url_was_named) {
    if (url_was_named && HandleUntil([this] { return metrics_heard_ || sim_heard_; }, kListen)) {
      throw InputError(bus().url() +
                       ": a run or another replay is active on this bus; pass another bus with --url");
    }
    processes_.Start("metrics",
                     {(runner::Processes::BinaryFolder() / "evalbus-metrics").string(), "--url", bus().url(),
                      kReplayOption, fs::absolute(options_.recording).lexically_normal().string()},
                     metrics_log_.path());
    if (!HandleUntil([this] { return metrics_heard_; }, kMetricsStart)) Overdue("metrics did not start");
  }

  // Plays one log, and prints whether its scores are equal to the recorded ones.
  void Play(const fs::path& file, const results::RescoredLog& log) {
    log_ = &log;
    scored_.assign(log.episodes.size(), false);
    playing_ = true;
    // LCM's player cannot read compressed logs.
    std::optional<MemoryFile> unpacked;
    if (const EventLogReader reader(file); reader.is_packed()) {
      const auto bytes = reader.unpacked();
      WriteWhole(unpacked.emplace().path(), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    }
    processes_.Start(
        "player",
        {program_.string(), "--speed", fmt::format("{}", options_.speed), "--lcm-url", bus().url(),
         "--regexp", PlayedChannels(), unpacked ? unpacked->path_from_outside().string() : file.string()},
        player_log_.path());
    HandleUntil([this] { return !playing_; }, std::nullopt);
    const auto done = [this] { return scored_.back(); };
    if (!HandleUntil(done, kSettle)) {
      // EPISODE_END was lost, is missing in the log, or is behind damaged data, at which LCM's player stops.
      // It is published here.
      const episode_summary_t& last = log.episodes.back().summary;
      episode_end_t end{};
      end.header = last.header;
      end.end_reason = last.end_reason;
      end.detail = last.end_detail;
      bus().Publish(channels::kEpisodeEnd, end);
      if (!HandleUntil(done, kOverdue)) Overdue("metrics published no score for " + file.string());
    }
    for (size_t i = 0; i < scored_.size() && !stop_requested(); ++i) {
      if (scored_[i]) continue;
      fmt::print("{:>7}  metrics published no score\n", log.episodes[i].summary.header.episode);
      lost_ += Ticks(log.episodes[i].summary);
    }
  }

  void StopAll() {
    Stop();
    for (const runner::Processes::Exit& exit : processes_.StopAll()) {
      // A player that is stopped exits with an error. This error is not reported.
      if (exit.name != "player") fmt::print(stderr, "warning: {}\n", exit.description);
    }
  }

  int equal() const { return equal_; }
  int64_t lost() const { return lost_; }

  // Returns the number of ticks that the score covers.
  static int64_t Ticks(const episode_summary_t& summary) {
    return summary.header.tick + 1 - summary.extended.missing_ticks;
  }

 private:
  // Handles messages until the condition is true, and then returns true. Returns false after `time` or after
  // a stop signal.
  template <class Condition>
  bool HandleUntil(Condition condition, std::optional<steady_clock::duration> time) {
    auto poll_at = steady_clock::now();
    Wait wait(poll_at);
    while (!condition()) {
      const auto now = steady_clock::now();
      const auto waited = wait.Elapsed(now);
      if (stop_requested() || (time && waited > *time)) return false;
      if (now >= poll_at) {
        Poll(now);
        view_->Poll(now);
        CheckProcesses();
        poll_at = now + kTick;
      }
      bus().Handle(poll_at);
    }
    return true;
  }

  void CheckProcesses() {
    const auto exit = processes_.Poll();
    if (!exit) return;
    if (exit->name != "player" || exit->code != 0) throw EnvironmentError(exit->description);
    playing_ = false;
  }

  void Overdue(const std::string& what) {
    if (stop_requested()) return;
    throw EnvironmentError(fmt::format("{} within {} s", what, kOverdue.count()));
  }

  // Compares the latest score. Metrics publishes RUN_SUMMARY after each score.
  void OnScore(const run_summary_t&) {
    if (!score_ || !log_) return;
    const episode_summary_t score = *score_;
    score_.reset();
    for (size_t i = 0; i < scored_.size(); ++i) {
      const results::RescoredEpisode& episode = log_->episodes[i];
      // A log may hold several runs, whose episodes have the same numbers.
      if (score.header.episode != episode.summary.header.episode ||
          score.header.attempt != episode.summary.header.attempt || score.seed != episode.summary.seed)
        continue;
      if (std::exchange(scored_[i], true)) continue;  // a repeated message
      view_->OnEpisodeDone(results::EpisodeJson("", "", score));
      const int64_t lost = Ticks(episode.summary) - Ticks(score);
      lost_ += lost;
      equal_ += episode.recorded && results::SameBits(*episode.recorded, score);
      std::string text;
      if (const int64_t absent = episode.summary.extended.missing_ticks; absent > 0) {
        text += fmt::format("the log lacks {}; ", Plural(absent, "tick"));
      }
      if (!episode.has_end) text += "no EPISODE_END in the log; ";
      if (lost > 0) text += fmt::format("{} lost in the replay; ", Plural(lost, "tick"));
      fmt::print("         {}{}\n", text, results::DescribeDifference(episode.recorded, score));
      std::fflush(stdout);
    }
  }

  const ReplayOptions& options_;
  MemoryFile metrics_log_, player_log_;
  // The timeout is effectively disabled, because a player may sleep for any time between two events.
  runner::Processes processes_{std::chrono::hours(24 * 365)};
  runner::LiveView* view_;
  fs::path program_;

  bool metrics_heard_ = false;
  bool sim_heard_ = false;
  // log_: the log that is being played. scored_: which of its episodes have a score.
  const results::RescoredLog* log_ = nullptr;
  bool playing_ = false;
  std::vector<uint8_t> scored_;
  std::optional<episode_summary_t> score_;

  int equal_ = 0;
  int64_t lost_ = 0;
};

void AddOptions(CLI::App* app, ReplayOptions* options) {
  app->add_option("recording", options->recording, "folder of a run, a suite or an episode, or a log")
      ->required();
  AddList(app, "--episode", &options->episodes,
          "numbers of a run's episodes, separated by commas; default: all");
  app->add_option("--speed", options->speed, "playback speed; 1: as fast as the robot moved")
      ->capture_default_str();
  app->add_option("--url", options->url,
                  "bus, udpm://ADDRESS:PORT?ttl=0; default: as for --url of 'evalbus run'");
  app->add_flag("--web", options->web,
                "show the replay in a browser ('evalbus web'); the page stays available until Ctrl-C");
}

// A log and its recorded scores.
struct Recording {
  fs::path file;
  results::RescoredLog log;
};
// The recordings of one run, or a single log.
using Recordings = std::vector<Recording>;

std::vector<Recordings> ReadRecordings(const ReplayOptions& options) {
  std::vector<Recordings> runs;
  const std::vector<fs::path> files = results::EpisodeLogs(options.recording, options.episodes);
  results::CheckHasEpisodes(options.recording, options.episodes);
  results::Rescorer rescorer;
  for (const fs::path& file : files) {
    results::RescoredLog log = rescorer.Rescore(file);
    if (log.episodes.empty()) {
      throw InputError(file.string() + ": no episode in this log (EVALBUS_MODEL and EVALBUS_EPISODE_BEGIN)");
    }
    CheckWaits(file, options.speed);
    if (runs.empty() || RunFolderOf(runs.back().back().file) != RunFolderOf(file)) {
      runs.emplace_back();
    }
    runs.back().push_back({file, std::move(log)});
  }
  return runs;
}

// Returns 0 if every score equals the recorded score and no ticks were lost; otherwise 2. Throws InputError,
// EnvironmentError.
int Replay(const ReplayOptions& options) {
  if (!(options.speed >= kSpeeds.least && options.speed <= kSpeeds.most)) {
    throw InputError(
        fmt::format("--speed: expected {} to {}, got {}", kSpeeds.least, kSpeeds.most, options.speed));
  }
  const std::vector<Recordings> runs = ReadRecordings(options);
  FindPlayer();
  std::optional<runner::WebChild> web;
  if (options.web) web.emplace();
  const std::string asked = options.url.empty() ? UrlOfEnvironment() : options.url;
  const ReservedBus reserved = ChooseBus(asked);
  const std::string& url = reserved.url();
  if (url.empty()) {
    throw EnvironmentError(
        "this machine has no multicast, which lcm-logplayer requires ('evalbus doctor' explains why); use "
        "'evalbus rescore', which works without multicast");
  }
  InstallStopSignals();
  const MemoryFile web_log;
  if (web) web->Start(options.recording, web_log.path());
  int episodes = 0, equal = 0, damaged = 0;
  int64_t ticks = 0, lost = 0;
  double simulated = 0;  // s
  const auto started = steady_clock::now();
  for (const Recordings& run : runs) {
    int of_run = 0;
    for (const Recording& recording : run) {
      damaged += recording.log.damaged_places > 0;
      of_run += static_cast<int>(recording.log.episodes.size());
      for (const results::RescoredEpisode& episode : recording.log.episodes) {
        ticks += Player::Ticks(episode.summary);
        simulated += static_cast<double>(episode.summary.header.sim_time_us) * 1e-6;
      }
    }
    episodes += of_run;
    if (runs.size() > 1 && &run != &runs.front()) fmt::print("\n");
    runner::LiveView view(stdout, Header(run[0].file, run[0].log.episodes[0], of_run));
    Bus bus(url);
    Player player(options, &bus, &view);
    player.Start(!asked.empty() && &run == &runs.front());
    for (const Recording& recording : run) {
      if (!stop_requested()) player.Play(recording.file, recording.log);
    }
    view.Finish();
    player.StopAll();
    if (stop_requested()) throw EnvironmentError("stopped before the end of the replay");
    equal += player.equal();
    lost += player.lost();
  }
  const double wall = std::chrono::duration<double>(steady_clock::now() - started).count();
  if (damaged > 0) {
    fmt::print(
        "\n{} damaged: LCM's player stops at the first damaged event; 'evalbus rescore' skips it and "
        "continues\n",
        damaged == 1 ? "a log is" : fmt::format("{} logs are", damaged));
  }
  fmt::print(
      "\n{} of {} episodes have scores bit-identical to the recorded ones; {} of {} ticks lost; {:.1f} s "
      "simulated in {:.1f} s\n",
      equal, episodes, lost, ticks, simulated, wall);
  if (web) web->Stay();
  return equal == episodes && lost == 0 ? 0 : 2;
}

}  // namespace

Action AddReplay(CLI::App* app) { return ActionOf<ReplayOptions>(app, AddOptions, Replay); }

}  // namespace evalbus::commands
