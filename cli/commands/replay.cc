// evalbus replay: plays recorded episodes into fresh metrics.

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/host.h"
#include "bus/private_network.h"
#include "cli/commands/commands.h"
#include "cli/launch/live_view.h"
#include "cli/launch/processes.h"
#include "cli/results/episode_json.h"
#include "cli/results/episode_logs.h"
#include "cli/results/rescorer.h"
#include "lcmtypes/clock.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

struct ReplayOptions {
  std::filesystem::path run_or_log;
  // Of a run: this episode only.
  std::optional<int> episode;
  // Simulated seconds per second.
  double speed = 1;
  // Empty: as for `evalbus run`.
  std::string url;
};

constexpr auto kTick = std::chrono::milliseconds(20);
// Components say STATUS more often than this.
constexpr auto kListen = std::chrono::milliseconds(700);
constexpr auto kMetricsStart = std::chrono::seconds(10);
// After the player: longer than metrics wait for late ticks, then for a score that is overdue.
constexpr auto kSettle = std::chrono::milliseconds(1500);
constexpr auto kOverdue = std::chrono::seconds(10);

fs::path FindPlayer() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    fs::path program = fs::path(folder) / "lcm-logplayer";
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  throw EnvironmentError("lcm-logplayer is not in PATH; fix: apt-get install liblcm-bin");
}

// What metrics, viz and monitors listen to. Not what the recorded metrics said, since fresh ones say it
// again; nor COMMAND, since a replay commands nobody.
std::string PlayedChannels() {
  std::string regex;
  for (const std::string_view channel :
       {std::string_view(channels::kModel), std::string_view(channels::kEpisodeBegin),
        std::string_view(channels::kState), std::string_view(channels::kContacts),
        std::string_view(channels::kEpisodeEnd)}) {
    (regex += regex.empty() ? "(" : "|") += channel;
  }
  return regex + ")";
}

// For what the programs print; gone in the end.
class ScratchFolder {
 public:
  ScratchFolder() : path_((fs::temp_directory_path() / "evalbus_replay_XXXXXX").string()) {
    if (!mkdtemp(path_.data())) throw EnvironmentError("cannot create " + path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  fs::path operator/(const std::string& name) const { return fs::path(path_) / name; }

 private:
  std::string path_;
};

launch::LiveHeader Header(const fs::path& log, const results::RescoredEpisode& first, int episodes) {
  const model_info_t& model = *first.model;
  launch::LiveHeader header;
  header.task = model.task;
  header.variation = model.variation;
  header.policy = "recorded";
  header.clock = model.clock;
  header.control_hz = 1 / ControlPeriod(model);
  header.seed = first.summary.seed;
  header.episodes = episodes;
  // The run's own page knows more than its logs.
  const fs::path parent = fs::absolute(log).parent_path().parent_path();
  const fs::path file = parent.parent_path() / kRunJson;
  if (parent.filename() != kEpisodesFolder || !fs::exists(file)) return header;
  const nlohmann::ordered_json run = ReadJsonFile(file);
  if (!run.is_object() || !run.value("policy", run).is_string() ||
      !run.value("seed", run).is_number_integer()) {
    throw InputError(file.string() +
                     ": expected an object with the text \"policy\" and the whole number \"seed\"");
  }
  header.policy = run["policy"];
  header.seed = run["seed"];
  return header;
}

// Says STATUS as "replay", by which a monitor knows what it watches.
class Player : public Component {
 public:
  Player(const ReplayOptions& options, Bus* bus, launch::LiveView* view)
      : Component(bus, "replay"), options_(options), view_(view), program_(FindPlayer()) {
    bus->Subscribe(channels::kStatus, [this](const component_status_t& status) {
      metrics_heard_ |= status.component == "metrics";
      sim_heard_ |= status.component == "sim";
    });
    bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
      if (!EnterEpisode(begin)) return;
      SayReady();
      view_->OnEpisodeBegin(begin);
    });
    bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& partial) {
      Progress(partial.header);
      view_->OnPartial(partial);
    });
    bus->Subscribe(channels::kEpisodeSummary, [this](const episode_summary_t& summary) { score_ = summary; });
    bus->Subscribe(channels::kRunSummary, [this](const run_summary_t& run) { OnScore(run); });
  }

  // Starts metrics; throws if a run is on this bus already.
  void Start() {
    if (!options_.url.empty() && HandleUntil([this] { return metrics_heard_ || sim_heard_; }, kListen)) {
      throw InputError("--url " + options_.url +
                       ": a run or another replay is on this bus; choose another port");
    }
    processes_.Start("metrics",
                     {(launch::Processes::BinaryFolder() / "evalbus-metrics").string(), "--url", bus().url()},
                     scratch_ / "metrics.log");
    if (!HandleUntil([this] { return metrics_heard_; }, kMetricsStart)) Overdue("metrics did not start");
  }

  // Plays one log and shows how its scores compare.
  void Play(const fs::path& file, const results::RescoredLog& log) {
    log_ = &log;
    scored_.assign(log.episodes.size(), false);
    playing_ = true;
    processes_.Start("player",
                     {program_.string(), "--speed", fmt::format("{}", options_.speed), "--lcm-url",
                      bus().url(), "--regexp", PlayedChannels(), file.string()},
                     scratch_ / "player.log");
    HandleUntil([this] { return !playing_; }, std::nullopt);
    const auto done = [this] { return scored_.back(); };
    if (!HandleUntil(done, kSettle)) {
      // EPISODE_END was lost, is not in the log, or is behind damage, where LCM's player stops.
      const episode_summary_t& last = log.episodes.back().summary;
      episode_end_t end{};
      end.header = last.header;
      end.end_reason = last.end_reason;
      end.detail = last.end_detail;
      bus().Publish(channels::kEpisodeEnd, end);
      if (!HandleUntil(done, kOverdue)) Overdue("metrics gave no score for " + file.string());
    }
    for (size_t i = 0; i < scored_.size() && !stop_requested(); ++i) {
      if (scored_[i]) continue;
      fmt::print("{:>7}  metrics gave no score\n", log.episodes[i].summary.header.episode);
      lost_ += Ticks(log.episodes[i].summary);
    }
  }

  void StopAll() {
    Stop();
    for (const launch::Processes::Exit& exit : processes_.StopAll()) {
      // Nobody expects a player that is stopped to end well.
      if (exit.name != "player") fmt::print(stderr, "warning: {}\n", exit.description);
    }
  }

  int equal() const { return equal_; }
  int64_t lost() const { return lost_; }

  // Ticks that the score covers.
  static int64_t Ticks(const episode_summary_t& summary) {
    return summary.header.tick + 1 - summary.extended.missing_ticks;
  }

 private:
  // True once the condition is, false when the time is over or the user wants to stop.
  template <class Condition>
  bool HandleUntil(Condition condition, std::optional<steady_clock::duration> time) {
    const auto started = steady_clock::now();
    auto poll_at = started;
    while (!condition()) {
      const auto now = steady_clock::now();
      if (stop_requested() || (time && now - started > *time)) return false;
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

  // Metrics' statistics follow each score of theirs.
  void OnScore(const run_summary_t&) {
    if (!score_ || !log_) return;
    const episode_summary_t score = *score_;
    score_.reset();
    for (size_t i = 0; i < scored_.size(); ++i) {
      const results::RescoredEpisode& episode = log_->episodes[i];
      if (score.header.episode != episode.summary.header.episode ||
          score.header.attempt != episode.summary.header.attempt)
        continue;
      if (std::exchange(scored_[i], true)) continue;  // said again
      view_->OnEpisodeDone(results::EpisodeJson("", "", score));
      const int64_t lost = Ticks(episode.summary) - Ticks(score);
      lost_ += lost;
      equal_ += episode.recorded && results::SameBits(*episode.recorded, score);
      std::string text;
      if (const int64_t absent = episode.summary.extended.missing_ticks; absent > 0) {
        text += fmt::format("{} ticks are missing in the log; ", absent);
      }
      if (!episode.has_end) text += "no EPISODE_END in the log; ";
      if (lost > 0) text += fmt::format("{} ticks were lost in the replay; ", lost);
      fmt::print("         {}{}\n", text, results::DescribeDifference(episode.recorded, score));
      std::fflush(stdout);
    }
  }

  const ReplayOptions& options_;
  ScratchFolder scratch_;
  launch::Processes processes_;
  launch::LiveView* view_;
  fs::path program_;

  bool metrics_heard_ = false;
  bool sim_heard_ = false;
  // What is being played, and which of its episodes have a score.
  const results::RescoredLog* log_ = nullptr;
  bool playing_ = false;
  std::vector<uint8_t> scored_;
  std::optional<episode_summary_t> score_;

  int equal_ = 0;
  int64_t lost_ = 0;
};

void AddOptions(CLI::App* app, ReplayOptions* options) {
  app->add_option("run_or_log", options->run_or_log, "run folder or event log")->required();
  app->add_option("--episode", options->episode, "of a run: this episode only");
  app->add_option("--speed", options->speed, "1 = as fast as the robot moved")->capture_default_str();
  app->add_option("--url", options->url, "bus, udpm://ADDRESS:PORT?ttl=0; default as for run");
}

// Returns 0 if every score equals the recorded one and nothing was lost, else 2. Throws InputError,
// EnvironmentError.
int Replay(const ReplayOptions& options) {
  if (!(options.speed > 0) || std::isinf(options.speed)) {
    throw InputError(fmt::format("--speed {}: expected a number above 0", options.speed));
  }
  // The logs say what is to be expected.
  results::Rescorer rescorer;
  std::vector<std::pair<fs::path, results::RescoredLog>> logs;
  int episodes = 0, damaged = 0;
  int64_t ticks = 0;
  double simulated = 0;  // s
  for (const fs::path& file : results::EpisodeLogs(options.run_or_log, options.episode)) {
    results::RescoredLog log = rescorer.Rescore(file);
    if (log.episodes.empty()) {
      throw InputError(file.string() + ": no episode in this log (EVALBUS_MODEL and EVALBUS_EPISODE_BEGIN)");
    }
    damaged += log.damaged_places > 0;
    episodes += static_cast<int>(log.episodes.size());
    for (const results::RescoredEpisode& episode : log.episodes) {
      ticks += Player::Ticks(episode.summary);
      simulated += static_cast<double>(episode.summary.header.sim_time_us) * 1e-6;
    }
    logs.emplace_back(file, std::move(log));
  }
  FindPlayer();
  const std::string url = ChooseBus(options.url);
  if (url.empty()) {
    throw EnvironmentError(
        "this machine has no multicast, which lcm-logplayer needs ('evalbus doctor' says why); "
        "'evalbus rescore' works without");
  }
  InstallStopSignals();
  launch::LiveView view(stdout, Header(logs[0].first, logs[0].second.episodes[0], episodes));
  Bus bus(url);
  Player player(options, &bus, &view);
  player.Start();
  const auto started = steady_clock::now();
  for (const auto& [file, log] : logs) {
    if (!stop_requested()) player.Play(file, log);
  }
  const double wall = std::chrono::duration<double>(steady_clock::now() - started).count();
  view.Finish();
  player.StopAll();
  if (stop_requested()) throw EnvironmentError("stopped before the end");
  if (damaged > 0) {
    fmt::print(
        "\n{} damaged: LCM's player stops at the first damaged event; 'evalbus rescore' goes on behind it\n",
        damaged == 1 ? "a log is" : fmt::format("{} logs are", damaged));
  }
  fmt::print(
      "\n{} of {} episodes equal the recorded scores in every bit; {} of {} ticks lost; {:.1f} s simulated "
      "in {:.1f} s\n",
      player.equal(), episodes, player.lost(), ticks, simulated, wall);
  return player.equal() == episodes && player.lost() == 0 ? 0 : 2;
}

}  // namespace

Action AddReplay(CLI::App* app) {
  const auto options = std::make_shared<ReplayOptions>();
  AddOptions(app, options.get());
  return [options] { return Replay(*options); };
}

}  // namespace evalbus::commands
