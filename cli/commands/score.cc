// Implements `evalbus score`, which scores recorded trajectories. For a trajectory in evalbus' JSON format,
// it prints the result dictionary. For other files, whose columns a YAML file maps to a task, it writes a run
// folder.
#include <fmt/format.h>

#include <memory>

#include "base/errors.h"
#include "cli/commands/commands.h"
#include "metrics/episode/score_file.h"
#include "runner/trajectory_score.h"

namespace evalbus::commands {
namespace {

struct ScoreArguments {
  std::string file, data, out;
  metrics::ScoreOptions score;
};

}  // namespace

Action AddScore(CLI::App* app) {
  const auto options = std::make_shared<ScoreArguments>();
  app->add_option("file", options->file,
                  "trajectory in the format of docs/metrics.md, or a YAML that maps the columns of a table "
                  "to a task (docs/data.md)")
      ->required();
  app->add_option("data", options->data,
                  "with a YAML: a .csv, .npz or .hdf5 file, or a folder of them, with one episode per file");
  app->add_option("--out", options->out, "with a YAML: run folder to write; default: runs/score-DATE-TIME");
  app->add_option("--collision-sample-window", options->score.collision_sample_window,
                  "number of steps between evaluations of contacts; 0: the file's slip_sample_window")
      ->capture_default_str();
  return [options, app] {
    const bool is_map = options->file.ends_with(".yaml") || options->file.ends_with(".yml");
    if (is_map) {
      if (app->count("--collision-sample-window") > 0) {
        throw InputError(
            options->file +
            ": --collision-sample-window requires a trajectory in the format of docs/metrics.md");
      }
      if (options->data.empty())
        throw InputError("expected the data file or folder that " + options->file + " maps");
      runner::ScoreTrajectories(options->file, options->data, options->out);
      return 0;
    }
    if (!options->data.empty() || !options->out.empty()) {
      throw InputError(options->file + ": a second file and --out require a YAML as the first file");
    }
    fmt::print("{}\n", metrics::ScoreFile(options->file, options->score).dump(2));
    return 0;
  };
}

}  // namespace evalbus::commands
