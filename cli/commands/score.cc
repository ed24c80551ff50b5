// evalbus score: scores one recorded trajectory, prints the result dictionary.
#include <fmt/format.h>

#include <memory>

#include "cli/commands/commands.h"
#include "metrics/episode/score_file.h"

namespace evalbus::commands {
namespace {

struct Options {
  std::string file;
  metrics::ScoreOptions score;
};

}  // namespace

Action AddScore(CLI::App* app) {
  const auto options = std::make_shared<Options>();
  app->add_option("file", options->file, "trajectory in the format of docs/metrics.md")->required();
  app->add_option("--collision-sample-window", options->score.collision_sample_window,
                  "look at contacts every this many steps; 0 = the file's slip_sample_window")
      ->capture_default_str();
  return [options] {
    fmt::print("{}\n", metrics::ScoreFile(options->file, options->score).dump(2));
    return 0;
  };
}

}  // namespace evalbus::commands
