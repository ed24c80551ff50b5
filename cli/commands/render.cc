// evalbus render: films episodes of a run from their logs.

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bus/host.h"
#include "cli/commands/commands.h"
#include "cli/results/episode_logs.h"
#include "viz/pictures/film.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct RenderOptions {
  std::filesystem::path run;
  // Empty: every finished episode.
  std::vector<int> episodes;
  std::vector<std::string> cameras = {"front"};
  std::string size = "640x480";
};

void AddOptions(CLI::App* app, RenderOptions* options) {
  app->add_option("run", options->run, "run folder, an episode's folder or a log")->required();
  app->add_option("--episode", options->episodes, "numbers of episodes, with commas; default: all")
      ->delimiter(',')
      ->allow_extra_args(false);
  app->add_option("--camera", options->cameras, "names of cameras, with commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  app->add_option("--size", options->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
}

// Prints the films' paths. Returns the exit code. Throws InputError, EnvironmentError.
int Render(const RenderOptions& options) {
  const viz::FrameSize size = viz::ParseFrameSize(options.size);
  std::vector<fs::path> logs;
  for (const int episode : options.episodes)
    logs.push_back(results::EpisodeLogs(options.run, episode).front());
  if (logs.empty()) logs = results::EpisodeLogs(options.run);
  // A film that is stopped takes its half-written file with it.
  InstallStopSignals();
  for (const fs::path& log : logs) {
    for (const fs::path& film : viz::FilmEpisode(log, options.cameras, size, log.parent_path())) {
      fmt::print("{}\n", fs::proximate(film).string());
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace

Action AddRender(CLI::App* app) {
  const auto options = std::make_shared<RenderOptions>();
  AddOptions(app, options.get());
  return [options] { return Render(*options); };
}

}  // namespace evalbus::commands
