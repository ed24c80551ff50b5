// Implements `evalbus export`, which writes the episodes of a run or a suite for other programs: as a table,
// a training set, MCAP files, or results for leaderboards and experiment trackers.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "cli/commands/python_module.h"
#include "export/episode_table.h"
#include "export/recording.h"
#include "export/training_set.h"
#include "results/episode_logs.h"
#include "results/run_reader.h"
#include "runner/progress_line.h"
#include "viz/images/renderer.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

// A kind of output that a module of python/evalbus writes.
struct PythonOutput {
  const char* option;
  const char* module;
  const char* type;
  const char* what;
};
constexpr PythonOutput kPythonOutputs[] = {
    {"--lerobot", "evalbus.lerobot.dataset", "FOLDER",
     "LeRobot data set with videos of --camera; requires LeRobot"},
    {"--inspect", "evalbus.inspect_log", "FILE", "log of Inspect (.eval or .json); requires inspect_ai"},
    {"--hf", "evalbus.hugging_face", "FOLDER",
     "results for leaderboards of Hugging Face; requires --dataset"},
    {"--wandb", "evalbus.trackers", "PROJECT", "send to Weights & Biases; requires wandb"},
    {"--trackio", "evalbus.trackers", "PROJECT", "the same for Trackio"},
    {"--mlflow", "evalbus.trackers", "EXPERIMENT", "the same for MLflow"},
    {"--tensorboard", "evalbus.trackers", "FOLDER", "write event files; requires tensorboard"},
};

struct ExportOptions {
  fs::path run;
  fs::path csv, hdf5, safetensors;
  // The option --mcap. Its file name may be omitted.
  CLI::Option* mcap = nullptr;
  fs::path mcap_file;
  std::vector<int> episodes;
  std::vector<std::string> cameras;
  // Image size; empty: the default size of the kind of file.
  std::string size;
  bool only_successes = false;
  // python: the options of kPythonOutputs. python_value: value of the requested option.
  std::vector<std::pair<PythonOutput, CLI::Option*>> python;
  std::string python_value;
  // Id of a benchmark's data set on the Hub.
  std::string dataset;
};

void AddOptions(CLI::App* app, ExportOptions* options) {
  app->add_option(
         "run", options->run,
         "folder of a run or a suite; with --mcap, the folder of an episode or a log is also accepted")
      ->required();
  auto* kinds = app->add_option_group("Output");
  kinds->add_option("--csv", options->csv, "CSV table with one row per finished episode; -: standard output")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  kinds->add_option("--hdf5", options->hdf5, "training set in robomimic's layout")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  kinds
      ->add_option("--safetensors", options->safetensors,
                   "training set in RoboEval's layout, one file per episode")
      ->type_name("FOLDER");
  options->mcap = kinds
                      ->add_option("--mcap", options->mcap_file,
                                   "MCAP for Foxglove, PlotJuggler and Rerun: file to write, for one "
                                   "episode; without a name:\nepisode.mcap next to each episode's log")
                      ->type_name("[FILE]")
                      ->expected(0, 1)
                      ->check(CheckOutputFile);
  for (const PythonOutput& output : kPythonOutputs) {
    options->python.emplace_back(output, kinds->add_option(output.option, options->python_value, output.what)
                                             ->type_name(output.type)
                                             ->check(CheckOutputFile));
  }
  // The parser rejects more than one kind of output.
  kinds->require_option(0, 1);
  app->add_flag("--successes", options->only_successes, "training sets: successful episodes only");
  AddList(app, "--episode", &options->episodes,
          "--mcap: numbers of episodes, separated by commas; default: all")
      ->needs(options->mcap);
  AddList(
      app, "--camera", &options->cameras,
      "--hdf5, --lerobot, --mcap: add images of these cameras, separated by commas, rendered from the logs");
  app->add_option("--size", options->size,
                  "size of images, WIDTHxHEIGHT in pixels; default: 640x480 for --mcap, otherwise 256x256");
  app->add_option("--dataset", options->dataset, "--hf: data set of the benchmark on the Hub")
      ->type_name("OWNER/NAME");
}

// Throws InputError if an option has no effect on the requested output.
void CheckOptions(const ExportOptions& options) {
  const auto is_requested = [&](std::string_view name) {
    return std::ranges::any_of(options.python, [&](const auto& output) {
      return name == output.first.option && output.second->count() > 0;
    });
  };
  const bool has_images = !options.hdf5.empty() || options.mcap->count() > 0 || is_requested("--lerobot");
  const bool is_training_set =
      !options.hdf5.empty() || !options.safetensors.empty() || is_requested("--lerobot");
  if (options.only_successes && !is_training_set)
    throw InputError("--successes requires --hdf5, --safetensors or --lerobot");
  if (!options.cameras.empty() && !has_images)
    throw InputError("--camera requires --hdf5, --lerobot or --mcap");
  if (!options.size.empty() && options.cameras.empty()) throw InputError("--size requires --camera");
  if (!options.dataset.empty() && !is_requested("--hf")) throw InputError("--dataset requires --hf");
}

[[noreturn]] void ExportByPython(const ExportOptions& options, const PythonOutput& output) {
  std::vector<std::string> arguments = {options.run.string(), output.option, options.python_value};
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) arguments.insert(arguments.end(), {option, value});
  };
  std::string cameras;
  for (const std::string& camera : options.cameras) cameras += (cameras.empty() ? "" : ",") + camera;
  add("--camera", cameras);
  add("--size", options.size);
  add("--dataset", options.dataset);
  if (options.only_successes) arguments.emplace_back("--successes");
  ExecPythonModule(output.module, arguments);
}

int ExportTable(const ExportOptions& options) {
  const results::RecordedRuns runs = results::ReadRuns(options.run);
  const std::string table = exports::EpisodeTable(runs.runs);
  const bool is_piped = options.csv == "-" || options.csv == "/dev/stdout";
  WriteWhole(is_piped ? "/dev/stdout" : options.csv, table);
  std::FILE* const words = is_piped ? stderr : stdout;
  size_t episodes = 0;
  for (const results::RecordedRun& run : runs.runs) episodes += run.episodes.size();
  fmt::print(words, "{}  {}\n", Plural(episodes, "episode"), options.csv.string());
  for (const results::RecordedRun& run : runs.runs) {
    for (const std::string& remark : run.Remarks()) fmt::print(words, "note: {}: {}\n", run.name, remark);
  }
  for (const std::string& missing : runs.missing)
    fmt::print(words, "note: {}/{}: no finished episode\n", runs.name, missing);
  return 0;
}

// Returns the logs of complete episodes; with --successes, only the logs of successful episodes.
std::vector<fs::path> LogsFor(const ExportOptions& options, size_t* left_out) {
  const results::RecordedRuns runs = results::ReadRuns(options.run);
  std::vector<fs::path> logs;
  for (const results::RecordedRun& run : runs.runs) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      if (!episode.complete || (options.only_successes && !episode.success)) {
        ++*left_out;
        continue;
      }
      logs.push_back(EpisodeLog(run.folder, episode.episode));
    }
  }
  if (logs.empty())
    throw InputError(options.run.string() + (options.only_successes ? ": no successful episode to export"
                                                                    : ": no complete episode to export"));
  return logs;
}

int ExportMcap(const ExportOptions& options) {
  results::CheckHasEpisodes(options.run, options.episodes);
  const std::vector<fs::path> logs = results::EpisodeLogs(options.run, options.episodes);
  if (!options.mcap_file.empty() && logs.size() != 1) {
    throw InputError(
        fmt::format("--mcap {}: a file holds one episode, got {}: choose one with --episode, or omit the "
                    "name to write a file next to each log",
                    options.mcap_file.string(), logs.size()));
  }
  const std::string size = options.size.empty() ? "640x480" : options.size;
  exports::SceneSource scenes;
  runner::ProgressLine line(logs.size(), "exporting");
  for (size_t i = 0; i < logs.size(); ++i) {
    const fs::path& log = logs[i];
    line.Show(static_cast<double>(i));
    exports::EncodedEpisode episode = exports::EncodeEpisode(log, &scenes);
    if (!options.cameras.empty()) exports::AddImages(log, options.cameras, size, &episode);
    const fs::path file = options.mcap_file.empty() ? log.parent_path() / "episode.mcap" : options.mcap_file;
    const std::string bytes = exports::McapFile(episode);
    WriteWhole(file, bytes);
    line.Clear();
    fmt::print("{} messages, {:.1f} MB  {}\n", episode.messages.size(),
               static_cast<double>(bytes.size()) * 1e-6, fs::proximate(file).string());
    std::fflush(stdout);
    for (const std::string& remark : episode.remarks) fmt::print(stderr, "warning: {}\n", remark);
  }
  return 0;
}

int ExportTrainingSet(const ExportOptions& options) {
  const fs::path& out = options.hdf5.empty() ? options.safetensors : options.hdf5;
  if (fs::exists(out)) throw InputError(out.string() + ": exists; choose another name");
  const viz::FrameSize size = viz::ParseFrameSize(options.size.empty() ? "256x256" : options.size);
  constexpr int kLargest = 2048;
  for (const int pixels : {size.width, size.height}) {
    if (pixels < 1 || pixels > kLargest) {
      throw InputError(fmt::format("--size {}: expected 1 to {} pixels per side", options.size, kLargest));
    }
  }
  if (const fs::path folder = fs::absolute(out).parent_path(); !fs::is_directory(folder)) {
    throw InputError(fmt::format("{}: no such folder: {}", out.string(), folder.string()));
  }
  size_t left_out = 0;
  const std::vector<fs::path> logs = LogsFor(options, &left_out);
  // After an interruption, the same command can reuse the images that were already rendered.
  InstallStopSignals();
  {
    runner::ProgressLine line(logs.size(), "exporting");
    const auto progress = [&](double share) { line.Show(share * static_cast<double>(logs.size())); };
    if (options.hdf5.empty()) {
      exports::WriteSafetensors(logs, out, progress);
    } else {
      exports::WriteRobomimic(logs, out, {options.cameras, size.width, size.height}, progress);
    }
  }
  fmt::print("{}{}  {}\n", Plural(logs.size(), "episode"),
             left_out > 0 ? fmt::format(" ({} left out)", left_out) : "", out.string());
  return 0;
}

}  // namespace

Action AddExport(CLI::App* app) {
  const auto options = std::make_shared<ExportOptions>();
  AddOptions(app, options.get());
  return [options] {
    CheckOptions(*options);
    for (const auto& [output, option] : options->python) {
      if (option->count() > 0) ExportByPython(*options, output);
    }
    if (options->mcap->count() > 0) return ExportMcap(*options);
    if (options->csv.empty() && options->hdf5.empty() && options->safetensors.empty())
      throw InputError("export: select what to write, for example --csv FILE ('evalbus export --help')");
    return options->csv.empty() ? ExportTrainingSet(*options) : ExportTable(*options);
  };
}

}  // namespace evalbus::commands
