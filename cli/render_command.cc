#include "cli/render_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>

#include "bus/errors.h"
#include "bus/recorder.h"
#include "viz/film.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

FrameSize ParseSize(const std::string& text) {
  FrameSize size;
  int used = 0;
  if (std::sscanf(text.c_str(), "%dx%d%n", &size.width, &size.height, &used) != 2 ||
      used != static_cast<int>(text.size())) {
    throw InputError("--size " + text + ": expected WIDTHxHEIGHT, such as 1280x720");
  }
  return size;
}

// Numbers of the episodes that are finished: 0007.partial is not.
std::vector<int> FinishedEpisodes(const fs::path& run) {
  std::vector<int> episodes;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(run / "episodes", error)) {
    const std::string name = entry.path().filename().string();
    int episode = -1;
    const auto parsed = std::from_chars(name.data(), name.data() + name.size(), episode);
    if (parsed.ptr == name.data() + name.size() && fs::exists(entry.path() / "events.lcmlog")) {
      episodes.push_back(episode);
    }
  }
  if (episodes.empty()) throw InputError(run.string() + ": not a run folder with finished episodes");
  std::sort(episodes.begin(), episodes.end());
  return episodes;
}

}  // namespace

void AddRenderOptions(CLI::App* app, RenderOptions* options) {
  app->add_option("run", options->run, "run folder")->required();
  app->add_option("--episode", options->episodes, "numbers of episodes, with commas; default: all")
      ->delimiter(',');
  app->add_option("--camera", options->cameras, "names of cameras, with commas")
      ->delimiter(',')
      ->capture_default_str();
  app->add_option("--size", options->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
}

int Render(const RenderOptions& options) {
  const FrameSize size = ParseSize(options.size);
  const std::vector<int> finished = FinishedEpisodes(options.run);
  for (const int episode : options.episodes) {
    if (!std::binary_search(finished.begin(), finished.end(), episode)) {
      throw InputError(fmt::format("{} has no finished episode {}; it has {} to {}", options.run.string(),
                                   episode, finished.front(), finished.back()));
    }
  }
  for (const int episode : options.episodes.empty() ? finished : options.episodes) {
    const fs::path folder = EpisodeFolder(options.run, episode);
    for (const fs::path& film : FilmEpisode(folder / "events.lcmlog", options.cameras, size, folder)) {
      fmt::print("{}\n", fs::proximate(film).string());
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace evalbus
