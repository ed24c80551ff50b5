// evalbus render: films episodes of a run from their logs.

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/errors.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "cli/launch/film_progress.h"
#include "cli/launch/filming.h"
#include "cli/results/episode_logs.h"
#include "viz/pictures/film.h"
#include "viz/pictures/renderer.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

struct RenderOptions {
  std::filesystem::path recording;
  // Empty: every finished episode.
  std::vector<int> episodes;
  std::vector<std::string> cameras = {viz::kDefaultCamera};
  std::string size = "640x480";
  // For who started us and reads our log.
  bool say_progress = false;
};

void AddOptions(CLI::App* app, RenderOptions* options) {
  app->add_option("recording", options->recording, "folder of a run, of a suite or of an episode, or a log")
      ->required();
  app->add_option("--episode", options->episodes, "numbers of episodes, with commas; default: all")
      ->delimiter(',')
      ->allow_extra_args(false);
  app->add_option("--camera", options->cameras, "names of cameras, with commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  app->add_option("--size", options->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
  app->add_flag("--say-progress", options->say_progress)->group("");
}

// Shows how far the films are: in place on a terminal, in lines for who reads our log, else not at all.
class Progress {
 public:
  Progress(size_t logs, bool say)
      : progress_(logs, 0, steady_clock::now()), is_terminal_(!say && isatty(STDOUT_FILENO)), say_(say) {}
  ~Progress() { Clear(); }

  void Show(double done) {
    const auto now = steady_clock::now();
    if (!(is_terminal_ || say_) || now - shown_ < std::chrono::milliseconds(200)) return;
    shown_ = now;
    is_terminal_ ? fmt::print("\x1b[K{}\r", progress_.Text(done, now))
                 : fmt::print("{}{}\n", launch::kFilmShare, done);
    std::fflush(stdout);
  }
  void Clear() const {
    if (is_terminal_) fmt::print("\x1b[K");
  }

 private:
  launch::FilmProgress progress_;
  bool is_terminal_, say_;
  steady_clock::time_point shown_{};
};

// Prints the films' paths. Returns the exit code. Throws InputError, EnvironmentError.
int Render(const RenderOptions& options) {
  const viz::FrameSize size = viz::ParseFrameSize(options.size);
  const std::vector<fs::path> logs = results::EpisodeLogs(options.recording, options.episodes);
  viz::FilmOptions film;
  // A log that was named may hold several.
  if (logs.size() == 1) film.episodes = options.episodes;
  // A film that is stopped takes its half-written file with it.
  InstallStopSignals();
  Progress progress(logs.size(), options.say_progress);
  size_t unfilmed = 0;
  for (size_t i = 0; i < logs.size(); ++i) {
    const auto run = results::RunOf(logs[i]);
    film.policy = run ? run->policy : "";
    film.progress = [&](double share) { progress.Show(static_cast<double>(i) + share); };
    try {
      const auto films = viz::FilmLog(logs[i], options.cameras, size, logs[i].parent_path(), film);
      progress.Clear();
      for (const fs::path& file : films) fmt::print("{}\n", fs::proximate(file).string());
      std::fflush(stdout);
    } catch (const InputError& error) {
      // Other logs may be good, where this one is what is wrong.
      if (logs.size() == 1 || !std::string(error.what()).starts_with(logs[i].string())) throw;
      progress.Clear();
      fmt::print(stderr, "warning: no film: {}\n", error.what());
      ++unfilmed;
    }
  }
  if (unfilmed > 0) throw InputError(fmt::format("{} of {} logs cannot be filmed", unfilmed, logs.size()));
  return 0;
}

}  // namespace

Action AddRender(CLI::App* app) {
  const auto options = std::make_shared<RenderOptions>();
  AddOptions(app, options.get());
  return [options] { return Render(*options); };
}

}  // namespace evalbus::commands
