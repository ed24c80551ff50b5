// Implements `evalbus render`, which renders videos of episodes from their logs.

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "cli/commands/file_options.h"
#include "results/episode_logs.h"
#include "runner/progress_line.h"
#include "runner/video_recording.h"
#include "viz/images/painter/gl_context.h"
#include "viz/images/panel_video.h"
#include "viz/images/parallel_frame_renderer.h"
#include "viz/images/renderer.h"
#include "viz/images/trail.h"
#include "viz/images/video.h"
#include "viz/images/video_writer.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

struct RenderOptions {
  std::filesystem::path recording;
  // Episodes to render; empty: every finished episode.
  std::vector<int> episodes;
  // Cameras to show; empty: the layout's default cameras.
  std::vector<std::string> cameras;
  std::string layout = "plain";
  // Size of the video; empty: the default size of the kind of video.
  std::string size;
  bool has_grid = false;
  // Columns and rows of the grid; empty: one cell per episode.
  std::string grid;
  // File to write; empty: next to the log or, for a grid, in the folder `recording`.
  std::filesystem::path out;
  std::string format;
  std::string gl = viz::kDefaultGl;
  std::string overlay = "full";
  double trail_s = 0;
  bool outline = false;
  viz::VideoTiming timing;
  // Prints progress lines for the process that started this one and reads its log.
  bool report_progress = false;
};

void AddOptions(CLI::App* app, RenderOptions* options) {
  app->add_option("recording", options->recording, "folder of a run, a suite or an episode, or a log")
      ->required();
  AddList(app, "--episode", &options->episodes, "numbers of episodes, separated by commas; default: all");
  AddList(app, "--camera", &options->cameras,
          "names of cameras, separated by commas; default: overview. With --layout full: the main "
          "camera, then\nup to three insets; default: overview, head, wrists");
  app->add_option("--layout", options->layout,
                  "plain: the image of a camera; full: with insets, stages, curves, timeline and end card")
      ->capture_default_str();
  app->add_option_function<std::string>(
         "--grid",
         [options](const std::string& shape) {
           options->has_grid = true;
           options->grid = shape;
         },
         "one video of many episodes in COLUMNSxROWS cells; default: one cell per episode, up to 36")
      ->expected(0, 1)
      ->default_str("");
  app->add_option("--size", options->size,
                  "WIDTHxHEIGHT in pixels; default: 640x480, with panels 1280x720 (GIF, WebP: 640x360)");
  app->add_option("--format", options->format, "mp4 (default), gif or webp; READMEs can show gif and webp");
  app->add_option("--gl", options->gl, viz::kGlHelp)->capture_default_str();
  app->add_option("--overlay", options->overlay,
                  "text in the plain layout: full; small: time and outcome; none, for papers and slides")
      ->capture_default_str();
  app->add_option("--trail", options->trail_s,
                  "seconds for which the paths of the wrists stay visible, in the plain layout");
  app->add_flag(
      "--outline", options->outline,
      "white outlines around the task's objects, which make small ones easy to see; not with --grid");
  AddVideoTiming(app, &options->timing);
  app->add_option("-o,--out", options->out,
                  "video file; its extension selects the format; default: next to the log");
  app->add_flag("--report-progress", options->report_progress)->group("");
}

// Shows the progress as a progress line for users, or as log lines for the process that started this one.
class Progress {
 public:
  Progress(size_t logs, bool print) : line_(logs, "recording video of"), print_(print) {}

  void Show(double done) {
    if (!print_) return line_.Show(done);
    const auto now = steady_clock::now();
    if (now - printed_ < runner::ProgressLine::kInPlace) return;
    printed_ = now;
    fmt::print("{}{}\n", runner::kVideoShare, done);
    std::fflush(stdout);
  }
  void Clear() { line_.Clear(); }

 private:
  runner::ProgressLine line_;
  bool print_;
  steady_clock::time_point printed_{};
};

// Returns the name of a grid cell, for example "episode 7" or, if there are several tasks, "lift_pot/position
// 7".
std::string CellName(const viz::VideoEpisode& episode, bool several_tasks) {
  return several_tasks ? fmt::format("{} {}", episode.facts.task, episode.facts.episode)
                       : fmt::format("episode {}", episode.facts.episode);
}

void PrintVideo(const fs::path& file) {
  fmt::print("{}\n", fs::proximate(file).string());
  std::fflush(stdout);
}

// Renders a video with a grid of many episodes, in the order of the logs.
void RenderGrid(const RenderOptions& options, const std::vector<fs::path>& logs, viz::FrameSize size,
                const std::string& ending) {
  if (options.cameras.size() > 1) throw InputError("--grid: expected one camera");
  // All cells share one clock, but each cell has its own decisive moment.
  if (options.timing.highlight_s > 0) throw InputError("--highlight cannot be combined with --grid");
  viz::JointVideoOptions joint;
  joint.size = size;
  if (!options.cameras.empty()) joint.camera = options.cameras[0];
  const bool is_shaped = !options.grid.empty();
  if (is_shaped) joint.shape = viz::ParseGridShape(options.grid);
  const size_t cells =
      is_shaped ? static_cast<size_t>(joint.shape.columns * joint.shape.rows) : viz::kMaxCells;
  std::vector<viz::VideoEpisode> episodes;
  std::set<std::string> tasks, makers;
  // Logs that have not been read are counted as one episode each.
  size_t known = logs.size();
  for (const fs::path& log : logs) {
    if (episodes.size() >= cells) break;
    const auto run = results::RunOf(log);
    const std::vector<int> wanted = logs.size() == 1 ? options.episodes : std::vector<int>();
    for (viz::VideoEpisode& episode :
         viz::ReadVideoEpisodes(log, wanted, run ? run->policy : "", options.timing)) {
      tasks.insert(episode.facts.task);
      makers.insert(episode.facts.maker);
      episodes.push_back(std::move(episode));
    }
  }
  if (logs.size() == 1) known = episodes.size();
  if (episodes.size() > cells) episodes.resize(cells);
  if (!is_shaped) joint.shape = viz::ShapeFor(static_cast<int>(episodes.size()));
  for (viz::VideoEpisode& episode : episodes) episode.name = CellName(episode, tasks.size() > 1);
  joint.title = tasks.size() == 1 ? *tasks.begin() : NameOfRun(options.recording);
  joint.subtitle = makers.size() == 1 ? *makers.begin() : Plural(tasks.size(), "task");
  joint.subtitle += episodes.size() < known ? fmt::format(", {} of {} episodes", episodes.size(), known)
                                            : ", " + Plural(known, "episode");
  const fs::path folder = fs::is_directory(options.recording) ? options.recording : logs[0].parent_path();
  const fs::path file = options.out.empty() ? folder / ("grid" + ending) : options.out;
  Progress progress(1, options.report_progress);
  joint.progress = [&](double share) { progress.Show(share); };
  viz::MakeGridVideo(episodes, joint, file);
  progress.Clear();
  PrintVideo(file);
  if (episodes.size() < known) {
    fmt::print("The video shows {} of {} episodes (first: {}, last: {}); use --episode to choose others.\n",
               episodes.size(), known, episodes.front().name, episodes.back().name);
  }
}

// Prints the videos' paths. Returns the exit code. Throws InputError or EnvironmentError.
int Render(const RenderOptions& options) {
  viz::VideoOptions video;
  video.layout = viz::ParseVideoLayout(options.layout);
  video.file = options.out;
  video.ending = !options.out.empty()     ? options.out.extension().string()
                 : options.format.empty() ? ".mp4"
                                          : "." + options.format;
  if (!options.format.empty() && video.ending != "." + options.format) {
    throw InputError("--format " + options.format + ": --out " + options.out.string() +
                     " selects another format by its extension");
  }
  viz::CheckVideoEnding(video.ending);
  // The output path is checked before the first video is rendered.
  if (!options.out.empty()) {
    const fs::path folder = fs::absolute(options.out).parent_path();
    if (!fs::is_directory(folder)) {
      throw InputError("--out " + options.out.string() + ": no such folder: " + folder.string());
    }
  }
  viz::CheckVideoTiming(options.timing);
  video.timing = options.timing;
  video.overlay = viz::ParseOverlay(options.overlay);
  const bool has_panels = options.has_grid || video.layout == viz::VideoLayout::kFull;
  if (has_panels && video.overlay != viz::OverlayAmount::kFull) {
    throw InputError("--overlay requires --layout plain, and cannot be combined with --grid");
  }
  if (!(options.trail_s >= 0 && options.trail_s <= viz::kLongestTrail)) {
    throw InputError(
        fmt::format("--trail {}: expected seconds, 0 to {}", options.trail_s, viz::kLongestTrail));
  }
  if (has_panels && options.trail_s > 0) {
    throw InputError("--trail requires --layout plain, and cannot be combined with --grid");
  }
  video.trail_s = options.trail_s;
  if (options.has_grid && options.outline) throw InputError("--outline cannot be combined with --grid");
  const std::string usual = !has_panels ? "640x480" : video.ending == ".mp4" ? "1280x720" : "640x360";
  const viz::FrameSize size = viz::ParseFrameSize(options.size.empty() ? usual : options.size);
  const std::vector<fs::path> logs = results::EpisodeLogs(options.recording, options.episodes);
  fmt::print(stderr, "{}", viz::UseGlAndDescribe(options.gl));
  // The signals are handled so that a partially written video is removed on a stop.
  InstallStopSignals();
  if (options.has_grid) {
    RenderGrid(options, logs, size, video.ending);
    return 0;
  }
  if (!options.out.empty() && logs.size() > 1) {
    throw InputError(
        fmt::format("--out {}: expected one episode, got {}; choose one with --episode, or show them "
                    "together with --grid",
                    options.out.string(), logs.size()));
  }
  std::vector<std::string> cameras = options.cameras;
  if (cameras.empty() && video.layout == viz::VideoLayout::kPlain) cameras = {viz::kDefaultCamera};
  // A log that is passed as a file may contain several episodes.
  if (logs.size() == 1) video.episodes = options.episodes;
  Progress progress(logs.size(), options.report_progress);
  viz::ParallelFrameRenderer frame_renderer(size, 0, options.outline);
  size_t without_video = 0;
  for (size_t i = 0; i < logs.size(); ++i) {
    const auto run = results::RunOf(logs[i]);
    video.policy = run ? run->policy : "";
    video.progress = [&](double share) { progress.Show(static_cast<double>(i) + share); };
    try {
      const auto videos = viz::MakeLogVideos(logs[i], cameras, &frame_renderer, logs[i].parent_path(), video);
      progress.Clear();
      for (const fs::path& file : videos) PrintVideo(file);
    } catch (const InputError& error) {
      // If the error concerns only this log, the other logs are still rendered.
      if (logs.size() == 1 || !std::string(error.what()).starts_with(logs[i].string())) throw;
      progress.Clear();
      fmt::print(stderr, "warning: no video: {}\n", error.what());
      ++without_video;
    }
  }
  if (without_video > 0)
    throw InputError(fmt::format("no video could be made of {} of {} logs", without_video, logs.size()));
  return 0;
}

}  // namespace

Action AddRender(CLI::App* app) { return ActionOf<RenderOptions>(app, AddOptions, Render); }

}  // namespace evalbus::commands
