// Implements `evalbus compare`, which tests whether runs or suites differ.

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/json_file.h"
#include "base/output_files.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "report/comparison_report.h"
#include "report/comparison_tables.h"
#include "report/viewer_pack.h"
#include "results/comparability.h"
#include "results/compared_runs.h"
#include "results/comparison.h"
#include "results/comparison_json.h"
#include "results/comparison_text.h"
#include "results/run_reader.h"
#include "runner/version.h"
#include "viz/images/panel_video.h"
#include "viz/images/video_writer.h"
#include "viz/terminal/terminal.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct CompareOptions {
  std::vector<std::filesystem::path> runs;
  // Name, policy or folder of the baseline that all other runs are compared with; empty: the first run.
  std::string baseline;
  // Names of the metrics to compare; empty: the main metrics.
  std::vector<std::string> on;
  // JSON file to write; empty: none.
  std::filesystem::path json;
  // Files with tables for other documents; empty: not written.
  std::filesystem::path markdown, latex;
  // HTML page to write; empty: none.
  std::filesystem::path report;
  // Maximum size of the HTML page with its viewer; 0: no viewer.
  double megabytes = report::kPageMegabytes;
  // Video file to write, with both runs on one seed side by side; empty: none.
  std::filesystem::path video;
  viz::VideoTiming timing;
  // Seed of the video's episodes; nullopt: the first seed on which only one of the runs succeeded or, if
  // there is none, the first common seed.
  std::optional<int64_t> seed;
  // True if runs may be compared although different versions of MuJoCo simulated them.
  bool across_engines = false;
};

void AddOptions(CLI::App* app, CompareOptions* options) {
  app->add_option("runs", options->runs, "folders of runs or suites, two or more")->required();
  app->add_option("--baseline", options->baseline,
                  "run that the others are compared with, by name, policy or folder; if given, effort "
                  "relative to it\nis also shown; default: the first");
  AddList(app, "--on", &options->on,
          "metrics to compare instead of the main ones, separated by commas, for example "
          "idle_time_s,tracking_error_rad;\nsuccess is always compared");
  app->add_option("--json", options->json, "also write the comparison to this file, as JSON")
      ->check(CheckOutputFile);
  app->add_option("--markdown", options->markdown,
                  "also write a table of success rates to this file, as Markdown")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  app->add_option("--latex", options->latex,
                  "also write the success rates to this file, as a LaTeX tabular (package booktabs)")
      ->type_name("FILE")
      ->check(CheckOutputFile);
  CLI::Option* const report =
      app->add_option("--report", options->report, "also write the comparison to this file, as one HTML page")
          ->check(CheckOutputFile);
  app->add_option("--mb", options->megabytes,
                  "maximum size of the page of --report in megabytes; as many pairs of episodes as fit can "
                  "be played in 3D,\nflipped seeds first; 0: none")
      ->check(InRange(0.0, 2000.0))
      ->needs(report)
      ->capture_default_str();
  app->add_option("--video", options->video,
                  "video of the two runs or suites on one seed, side by side: .mp4, .gif or .webp");
  AddVideoTiming(app, &options->timing);
  app->add_option("--seed", options->seed,
                  "seed of the video's episodes; default: the first at which only one of the two succeeded");
  app->add_flag("--across-engines", options->across_engines,
                "compare runs that different versions of MuJoCo simulated, although success rates depend on "
                "the version\n('evalbus certify' tests by how much)");
}

// Reads an episode of a run and labels it with the run's name.
viz::VideoEpisode ReadVideoEpisode(const fs::path& run, const std::string& name, int episode,
                                   const viz::VideoTiming& timing) {
  const std::string policy = results::ReadRunInfo(run).policy;
  auto video_episodes = viz::ReadVideoEpisodes(EpisodeLog(run, episode), {episode}, policy, timing);
  video_episodes.back().name = name;
  return std::move(video_episodes.back());
}

// Returns the episodes of the video; nullopt if none is wanted. Throws InputError.
std::optional<results::SeedPair> FindPairOfVideo(const results::RecordedRuns& run,
                                                 const results::RecordedRuns& baseline,
                                                 const CompareOptions& options) {
  if (options.video.empty()) return std::nullopt;
  auto pair = results::FindSeedPair(run, baseline, options.seed);
  if (!pair) {
    throw InputError(options.seed ? fmt::format("--video: seed {} is not in both runs", *options.seed)
                                  : "--video: the two runs have no seed in common on the same task");
  }
  return pair;
}

// Returns the numbers of the episodes, the baseline's first, and their seed.
std::string PairText(const results::SeedPair& pair) {
  return pair.episode == pair.baseline_episode
             ? fmt::format("episode {}, seed {}", pair.episode, pair.seed)
             : fmt::format("episodes {} and {}, seed {}", pair.baseline_episode, pair.episode, pair.seed);
}

// Makes a video of two episodes side by side, with the baseline on the left.
void MakeVideo(const results::SeedPair& pair, const results::RecordedRuns& run,
               const results::RecordedRuns& baseline, const CompareOptions& options) {
  viz::JointVideoOptions video;
  video.title = pair.run->task_name();
  video.subtitle = PairText(pair);
  if (options.video.extension() != ".mp4") video.size = {640, 360};
  viz::VideoTiming timing = options.timing;
  if (timing.highlight_s > 0) {
    // Both sides share one clock, which runs at normal speed around the decisive moments of either side.
    timing.moments_s = {viz::ReadDecisiveMoment(EpisodeLog(pair.baseline->folder, pair.baseline_episode),
                                                pair.baseline_episode),
                        viz::ReadDecisiveMoment(EpisodeLog(pair.run->folder, pair.episode), pair.episode)};
  }
  InstallStopSignals();
  viz::MakePairVideo({ReadVideoEpisode(pair.baseline->folder, baseline.name, pair.baseline_episode, timing),
                      ReadVideoEpisode(pair.run->folder, run.name, pair.episode, timing)},
                     video, options.video);
  fmt::print("\nvideo    {}  ({})\n", options.video.string(), PairText(pair));
}

// Returns the exit code, which is 0 for any result of the comparison. Throws InputError or EnvironmentError.
int Compare(const CompareOptions& options) {
  std::vector<results::RecordedRuns> runs;
  for (const fs::path& folder : options.runs) runs.push_back(results::ReadForComparison(folder));
  results::NameApart(&runs);
  if (!options.video.empty()) viz::CheckVideoEnding(options.video.extension().string());
  if (options.seed && options.video.empty()) throw InputError("--seed requires --video");
  if (options.timing != viz::VideoTiming() && options.video.empty()) {
    throw InputError("--highlight, --speed and --trim require --video");
  }
  viz::CheckVideoTiming(options.timing);
  CheckFilesDiffer({{"--json", options.json},
                    {"--markdown", options.markdown},
                    {"--latex", options.latex},
                    {"--report", options.report},
                    {"--video", options.video}});
  results::RecordedRuns baseline = results::RemoveBaseline(options.baseline, &runs);
  if (runs.empty()) throw InputError("expected two or more runs, got only " + baseline.folder.string());
  if (!options.video.empty() && runs.size() != 1)
    throw InputError(fmt::format("--video: expected two runs or suites, got {}", runs.size() + 1));
  // A baseline that is only named by --baseline may have the name of a run.
  runs.push_back(std::move(baseline));
  results::NameApart(&runs);
  baseline = std::move(runs.back());
  runs.pop_back();
  std::vector<const results::RecordedRuns*> all = {&baseline};
  for (const results::RecordedRuns& run : runs) all.push_back(&run);
  if (!options.across_engines) results::CheckSameEngine(all);
  const auto pair_of_video = FindPairOfVideo(runs[0], baseline, options);
  const std::vector<results::Comparison> comparisons = results::CompareAll(runs, baseline, options.on);
  const int width = viz::TerminalWidth(stdout);
  const std::vector<results::RankedRun> ranking = results::RankBySuccess(all);
  if (!ranking.empty()) fmt::print("{}\n\n", results::RankingText(ranking, width));
  for (size_t i = 0; i < comparisons.size(); ++i) {
    fmt::print("{}{}", i == 0 ? "" : "\n\n",
               results::ComparisonText(comparisons[i], !options.baseline.empty(), UsesColors(stdout), width));
  }
  if (!options.json.empty()) {
    WriteWhole(options.json, ToText(results::ComparisonJson(comparisons, ranking), 2) + "\n");
    fmt::print("\njson     {}\n", options.json.string());
  }
  if (!options.markdown.empty()) WriteWhole(options.markdown, report::ComparisonMarkdown(comparisons));
  if (!options.latex.empty()) WriteWhole(options.latex, report::ComparisonLatex(comparisons));
  if (!options.report.empty()) {
    const report::BuiltPage page = report::ComparisonReport(
        comparisons, options.report, fmt::format("{} ({})", kVersion, kGitCommit),
        static_cast<size_t>(options.megabytes * 1e6), report::ComparisonSource(comparisons, options.report));
    WriteWhole(options.report, page.html);
    fmt::print("\nreport   {}\n", options.report.string());
    if (!page.note.empty()) {
      fmt::print("{} The page has {:.1f} MB.\n", page.note, static_cast<double>(page.html.size()) / 1e6);
    }
  }
  if (pair_of_video) MakeVideo(*pair_of_video, runs[0], baseline, options);
  return 0;
}

}  // namespace

Action AddCompare(CLI::App* app) { return ActionOf<CompareOptions>(app, AddOptions, Compare); }

}  // namespace evalbus::commands
