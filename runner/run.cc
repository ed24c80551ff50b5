#include "runner/run.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/realtime.h"
#include "base/reserved_stdout.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "bus/host.h"
#include "bus/private_network.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/source.h"
#include "report/web/judge.h"
#include "results/operator_results.h"
#include "results/pacing.h"
#include "results/run_summary.h"
#include "results/summary_table.h"
#include "runner/launch.h"
#include "runner/live_view.h"
#include "runner/prepared_run.h"
#include "runner/suite.h"
#include "runner/video_recording.h"
#include "runner/web_child.h"
#include "runner/workers.h"
#include "sim/source_map.h"
#include "viz/images/video.h"
#include "viz/terminal/terminal.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;

using std::chrono::steady_clock;

// LCM's default URL.
constexpr char kLcmUrl[] = "udpm://239.255.76.67:7667?ttl=0";

double SecondsSince(steady_clock::time_point start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

const char* ClockOf(const RunOptions& options) {
  if (options.watch) return clock_name::kSource;
  return options.sim.realtime ? clock_name::kRealtime : clock_name::kLockstep;
}

LiveHeader HeaderOf(const PreparedRun& run) {
  const RunOptions& options = run.options;
  return {run.plan.task,          run.plan.variation,
          PolicyName(options),    ClockOf(options),
          options.sim.control_hz, options.seed,
          run.num_wanted(),       static_cast<int>(run.finished.size()),
          options.round < 1,      !options.judged_by.empty()};
}

// Runs the missing episodes, and records videos in parallel.
void Evaluate(const PreparedRun& run, LiveView* view, VideoRecording* video_recording) {
  for (const auto& episode : run.finished) video_recording->OnEpisodeDone(episode);
  if (run.plan.policy_is_external && !run.plan.is_by_hand) {
    fmt::print("waiting for a policy on {}\n", run.options.url);
    std::fflush(stdout);
  }
  if (run.options.watch) {
    fmt::print("contacts: from the {}\n", run.options.sim.contacts == contacts_from::kSource
                                              ? "source"
                                              : "collision shapes of " + run.plan.task);
    fmt::print("waiting for a source that publishes SOURCE_ANNOUNCEMENT on {}\n", run.options.url);
    std::fflush(stdout);
  }
  if (run.options.sim.realtime) {
    const Realtime allowed = RealtimeAllowed();
    fmt::print("real time: {}{}\n", allowed.Words(),
               allowed.is_scheduled && allowed.is_locked ? "" : " (see 'evalbus doctor')");
    std::fflush(stdout);
  }
  const auto evaluate = run.options.workers > 1  ? EvaluateWorkers
                        : run.options.in_process ? EvaluateInProcess
                                                 : EvaluateProcesses;
  if (!run.plan.episodes.empty()) evaluate(run.options, run.folder, run.plan, video_recording);
  view->Finish();
}

void PrintSummary(const PreparedRun& run, const results::RunSummary& summary, double wall_s) {
  const bool colors = UsesColors(stdout);
  fmt::print("\n{}", results::SummaryTable(summary.statistics, viz::TerminalWidth(stdout), colors));
  if (run.options.sim.realtime && summary.statistics.episodes > 0) {
    fmt::print("\n{}", results::PacingText(summary.pacing));
  }
  if (!summary.policy_notes.empty()) fmt::print("\n");
  for (const std::string& note : summary.policy_notes) fmt::print("{}\n", note);
  const auto shown = run.folder.shown();
  if (const std::string note = results::InvalidText(summary.statistics.invalid, shown.string());
      !note.empty()) {
    fmt::print("\n{}", note);
  }
  if (!summary.failed.empty()) {
    fmt::print("\n{}", results::FailedEpisodesText(summary.failed, shown.string(), viz::TerminalWidth(stdout),
                                                   colors));
  }
  const size_t added = static_cast<size_t>(summary.statistics.episodes) - run.finished.size();
  fmt::print("\n{} in {:.1f} s{}\n", Plural(added, "episode"), wall_s,
             run.finished.empty() ? "" : fmt::format(", {} finished earlier", run.finished.size()));
  if (summary.statistics.episodes == 0) return;
  fmt::print("results  {}\n", (shown / kEpisodesJsonl).string());
  fmt::print("summary  {}\n", (shown / kSummaryJson).string());
  const char* const ending = run.options.recorder.log == "zstd" ? kPackedEnding : "";
  fmt::print("logs     {}{}\n", (shown / kEpisodesFolder / "*" / kEventLog).string(), ending);
  fmt::print("look     {}\n", ShellWords({"evalbus", "web", shown.string()}));
  fmt::print("share    {}\n", ShellWords({"evalbus", "report", shown.string()}));
}

// Prints the results. If there is an operator, first waits until all episodes have been judged.
void PrintResults(const PreparedRun& run, const results::RunSummary& summary, double wall_s, WebChild* web) {
  const std::string& judged_by = run.options.judged_by;
  const auto folder = run.folder.path();
  if (judged_by.empty() || summary.statistics.episodes == 0) return PrintSummary(run, summary, wall_s);
  const auto is_judged = [&] { return report::HasJudgedAll(folder, judged_by); };
  if (!is_judged()) {
    fmt::print("\nthe results are shown when {} has judged all episodes on the page\n", judged_by);
    std::fflush(stdout);
  }
  web->StayUntil(is_judged);
  if (!is_judged()) {
    fmt::print("to continue  {}\n",
               ShellWords({"evalbus", "judge", run.folder.shown().string(), "--operator", judged_by}));
    return;
  }
  PrintSummary(run, summary, wall_s);
  fmt::print("\n");
  for (const std::string& line : results::JudgmentLines({results::ReadJudgedRun(folder)}))
    fmt::print("{}\n", line);
}

void WriteBegin(const PreparedRun& run, JsonEvents* events) {
  const LiveHeader header = HeaderOf(run);
  events->Begin({{"run", run.folder.path().string()},
                 {"policy", header.policy},
                 {"task", header.task},
                 {"variation", header.variation}},
                {{"seed", header.seed},
                 {"episodes", header.episodes},
                 {"finished", header.there_before},
                 {"control_hz", header.control_hz},
                 {"clock", header.clock}});
}

void RunOne(RunOptions options, const RunOutput& output = {}) {
  std::optional<JsonEvents> events;
  if (output.json) events.emplace(output);
  if (options.resume && options.round < 0 && !fs::exists(fs::path(options.out) / kRunJson)) {
    fmt::print("{} has no run to resume: starting a new one\n", Printable(options.out));
  }
  const bool has_default_name = options.out.empty();
  PreparedRun run = PrepareRun(std::move(options));
  InstallStopSignals();
  const auto started = steady_clock::now();
  std::optional<WebChild> web;
  std::optional<LiveView> view;
  std::optional<VideoRecording> video_recording;
  try {
    if (run.options.web || !run.options.judged_by.empty()) web.emplace();
    Announce(&run);
    // The page must run in the run's network namespace, which Announce() may have entered.
    if (web) web->Start(run.folder.path(), run.folder.log_file("web"), run.options.judged_by);
    view.emplace(stdout, HeaderOf(run));
    RunListener* listener = &*view;
    if (events) {
      events->SetNext(&*view);
      WriteBegin(run, &*events);
      listener = &*events;
    }
    video_recording.emplace(run.folder, run.options.video, run.options.gl, listener);
    Evaluate(run, &*view, &*video_recording);
    // The log of a source's unfinished episode is kept, because the episode cannot be repeated.
    if (has_default_name && !run.options.watch && !fs::exists(run.folder.path() / kEpisodesJsonl))
      throw EnvironmentError("stopped before an episode had finished; no run folder was kept");
  } catch (...) {
    run.folder.Remove();
    throw;
  }
  run.folder.RemoveHalfWritten();
  const double wall_s = SecondsSince(started);
  const results::RunSummary summary = results::WriteRunSummary(run.folder.path());
  if (run.options.round < 0) PrintResults(run, summary, wall_s, web ? &*web : nullptr);
  if (output.quiet) {
    fmt::print(stderr, "{}", results::InvalidText(summary.statistics.invalid, run.folder.shown().string()));
  }
  if (events) events->Finish(ReadJsonFile<nlohmann::ordered_json>(run.folder.path() / kSummaryJson));

  const size_t without_video = video_recording->Finish();
  const auto shown = run.folder.shown();
  for (const std::string& camera : run.options.video) {
    if (without_video > 0) break;
    fmt::print("videos   {}  (complete after {:.1f} s)\n",
               (shown / kEpisodesFolder / "*" / viz::VideoName(camera)).string(), SecondsSince(started));
  }
  if (summary.statistics.episodes < run.num_wanted() && run.options.watch) {
    fmt::print("stopped after {} of {}\n", summary.statistics.episodes, Plural(run.num_wanted(), "episode"));
  } else if (summary.statistics.episodes < run.num_wanted()) {
    throw EnvironmentError(fmt::format("stopped after {} of {}; to resume, run {}",
                                       summary.statistics.episodes, Plural(run.num_wanted(), "episode"),
                                       results::SameCommand(shown)));
  }
  if (without_video > 0) {
    throw EnvironmentError(fmt::format("stopped: {} {} no video yet; to record the rest, run {}",
                                       Plural(without_video, "episode"), without_video == 1 ? "has" : "have",
                                       results::SameCommand(shown)));
  }
  if (web) web->Stay();
}

}  // namespace

void Watch(RunOptions options) {
  if (!options.judged_by.empty()) results::CheckOperatorName(options.judged_by);
  if (options.web && !options.judged_by.empty())
    throw InputError("--web cannot be combined with --operator: the page of --web shows the scores");
  if (options.video == std::vector<std::string>{"none"}) options.video.clear();
  if (options.url.empty()) options.url = UrlOfEnvironment();
  if (options.url.empty()) options.url = kLcmUrl;
  unsetenv(kUrlVariable);
  sim::CheckSimOptions(options.sim);
  CheckRanges(options);
  CheckPolicyName(options);
  if (!options.sim.map.empty()) {
    sim::ReadSourceMap(ReadInput(options.sim.map, "map of a source"), options.sim.map);
    options.sim.map = fs::absolute(options.sim.map).lexically_normal();
  }
  options.watch = options.sim.is_source = true;
  options.policy.policy = "source";
  RunOne(std::move(options));
}

void RunWorker(RunOptions options) {
  InstallStopSignals();
  const PreparedRun run = PrepareWorker(std::move(options));
  WorkerLog log;
  (run.options.in_process ? EvaluateInProcess : EvaluateProcesses)(run.options, run.folder, run.plan, &log);
}

void Run(RunOptions options, const RunOutput& output) {
  std::optional<ReservedStdout> no_text;
  if (output.quiet && !output.json) no_text.emplace(true);
  if (options.video == std::vector<std::string>{"none"}) options.video.clear();
  const std::vector<std::string> tasks = ExpandTasks(options.tasks);
  // Uses the bus from the environment only if no command-line option selects a bus. Processes of this run
  // receive its bus as an option.
  if (options.url.empty() && !options.in_process && options.workers == 1 && tasks.size() == 1) {
    options.url = UrlOfEnvironment();
  }
  unsetenv(kUrlVariable);
  CheckRunOptions(options, tasks.size());
  if (tasks.size() > 1) {
    return RunSuite(options, tasks, output);
  }
  if (output.partial_hz > 0 && options.workers > 1)
    throw InputError("--partial-hz: expected --workers 1 for a single run");
  options.sim.task = tasks[0];
  RunOne(std::move(options), output);
}

}  // namespace evalbus::runner
