#include "report/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/text.h"
#include "bus/episode_reader.h"
#include "report/episode_tracks.h"
#include "report/page/page_check.h"
#include "report/page/report_page.h"
#include "report/page_links.h"
#include "report/stills.h"
#include "report/viewer_pack.h"
#include "results/circumstances.h"
#include "results/episode_logs.h"
#include "results/operator_results.h"
#include "results/pacing.h"
#include "results/policy_calls.h"
#include "results/tally.h"

namespace evalbus::report {
namespace {

constexpr size_t kFailuresDrawn = 2;
// The report of a suite shows one episode of each run, with its most informative figures only.
constexpr size_t kFiguresInSuite = 6;

struct Choice {
  int episode;
  std::string why;
};

// Returns the first failures and the success with the median time; for runs without a failure, also the
// slowest success.
std::vector<Choice> ChooseEpisodes(const results::RecordedRun& run, size_t failures) {
  std::vector<Choice> chosen;
  std::vector<std::pair<double, int>> successes;  // time, episode
  for (const results::RecordedEpisode& episode : run.episodes) {
    if (!episode.complete || !episode.judged()) continue;
    if (episode.success) {
      successes.emplace_back(episode.completion_time, episode.episode);
    } else if (chosen.size() < failures) {
      chosen.push_back({episode.episode, chosen.empty() ? "first failure" : "next failure"});
    }
  }
  if (successes.empty()) return chosen;
  std::sort(successes.begin(), successes.end());
  const int median = successes[(successes.size() - 1) / 2].second, slowest = successes.back().second;
  const bool failed = !chosen.empty();
  chosen.push_back({median, "success with the median time"});
  if (!failed && slowest != median) chosen.push_back({slowest, "slowest success"});
  return chosen;
}

// Smaller changes, in SI units, are ignored. This limit is above the simulated jitter of resting objects.
constexpr double kChange = 1e-5;

bool Changes(const viz::EpisodeTrack& track, size_t row) {
  double first = std::numeric_limits<double>::quiet_NaN();
  for (int64_t tick = 0; tick < track.ticks(); ++tick) {
    const double value = track.Value(row, tick);
    if (!std::isfinite(value)) continue;
    if (std::isnan(first)) first = value;
    if (std::abs(value - first) > kChange) return true;
  }
  return false;
}

CurveFigure Figure(const viz::EpisodeTrack& track, const viz::Curve& curve) {
  CurveFigure figure{.name = curve.label, .unit = curve.unit, .time = {}, .lines = {}, .events = {}};
  for (const std::string& part : curve.parts) figure.lines.push_back({part, {}});
  // A single line has points only at its own samples. Several lines share their times, with NaN for missing
  // values.
  const bool is_single = figure.lines.size() == 1;
  for (int64_t tick = 0; tick < track.ticks(); ++tick) {
    if (!track.has_tick(tick)) continue;
    if (is_single && curve.is_sparse && std::isnan(track.Value(curve.first_row, tick))) continue;
    figure.time.push_back(track.Time(tick));
    for (size_t part = 0; part < figure.lines.size(); ++part) {
      figure.lines[part].value.push_back(track.Value(curve.first_row + part, tick) * curve.scale);
    }
  }
  return figure;
}

// Returns stages reached, slips, collisions with the scene, self-collisions, force limits exceeded, and the
// end, in order of time.
std::vector<EpisodeEvent> Events(const viz::EpisodeTrack& track) {
  using From = viz::TrackEvent::Kind;
  using Kind = EpisodeEvent::Kind;
  std::vector<EpisodeEvent> events;
  for (const viz::TrackEvent& event : track.Events()) {
    if (event.kind == From::kGrasp || event.kind == From::kRelease || event.kind == From::kCause ||
        event.kind == From::kNoReturn)
      continue;
    const Kind kind = event.kind == From::kStage  ? Kind::kStage
                      : event.kind == From::kSlip ? Kind::kSlip
                      : event.kind == From::kEnd  ? Kind::kEnd
                                                  : Kind::kCollision;
    events.push_back({kind, event.time, event.text});
  }
  return events;
}

// Returns one figure for each metric that changes over the ticks of the episode, with a line for each of its
// parts (arms, distances), the most informative first, and the events.
ReportCurves CurvesOf(const viz::EpisodeTrack& track) {
  ReportCurves curves;
  curves.events = Events(track);
  for (const viz::Curve& curve : track.curves().curves()) {
    bool changes = false;
    for (size_t part = 0; part < curve.parts.size(); ++part) {
      changes = changes || Changes(track, curve.first_row + part);
    }
    if (!changes) continue;
    curves.figures.push_back(Figure(track, curve));
    curves.figures.back().events = curves.events;
  }
  return curves;
}

// Returns a remark if the log of a shown episode is damaged or incomplete; otherwise an empty text.
std::string LogRemark(const results::RecordedRun& run, int episode) {
  const std::filesystem::path log = results::EpisodeLogs(run.folder, {episode}).front();
  EpisodeReader reader(log, {});
  std::optional<EpisodeMessages> last;
  for (EpisodeMessages read; reader.Next(&read);) last = std::move(read);
  const std::string why = reader.WhyNotWhole(last ? &*last : nullptr);
  return why.empty() ? "" : fmt::format("episode {}: {}: {}", episode, log.string(), why);
}

void AddCurves(const std::vector<Choice>& choices, bool asked_for, ReportRun* report) {
  for (const Choice& choice : choices) {
    try {
      const auto track = TrackEpisode(results::EpisodeLogs(report->run.folder, {choice.episode}).front(), {});
      ReportCurves curves = CurvesOf(*track);
      curves.episode = choice.episode;
      curves.why = choice.why;
      // These values are stored only in the logs.
      if (report->curves.empty()) {
        const metric_values_t& metrics = track->summary()->metrics;
        for (size_t k = 0; k < metrics.stage_index.size(); ++k) {
          report->stage_name[metrics.stage_index[k]] = metrics.stage_name[k];
        }
        report->model_hashes = {{"physics_sha256", track->model().physics_sha256},
                                {"visual_sha256", track->model().visual_sha256}};
      }
      report->curves.push_back(std::move(curves));
    } catch (const InputError& error) {
      if (asked_for) throw;
      report->remarks.push_back(fmt::format("no curves of episode {}: {}", choice.episode, error.what()));
    }
  }
}

// Returns the page's title, for example "expert succeeds in 19 of 20 episodes of lift_pot/position".
std::string TitleOf(const results::RecordedRuns& runs) {
  const results::RecordedRun& first = runs.runs.at(0);
  results::Tally tally;
  for (const results::RecordedRun& run : runs.runs) tally.Add(run);
  const metrics::RunSummary summary = tally.Summary();
  const std::string tasks = runs.runs.size() == 1 ? first.task_name() : Plural(runs.runs.size(), "task");
  if (summary.judged == 0) return first.policy + " on " + tasks;
  return fmt::format("{} succeeds in {} of {} of {}", first.policy, summary.successes,
                     Plural(summary.judged, "episode"), tasks);
}

ReportRun Describe(results::RecordedRun run, const std::vector<int>& episodes, bool in_suite,
                   const PageLinks& links, const CommandOf& command_of) {
  ReportRun report;
  report.command = command_of(run.info);
  report.summary = run.Statistics().Summary(true);
  report.remarks = run.Remarks();
  report.notes = results::PolicyNotes(run);
  for (const results::OperatorResult& result : results::OperatorResults(run, results::ReadVerdictsOf(run))) {
    for (std::string& sentence : results::OperatorSentences(result))
      report.operators.push_back(std::move(sentence));
  }
  report.no_returns = results::ReadNoReturns(run.folder);
  report.pacing = results::RunPacing(run);
  for (const results::RecordedEpisode& episode : run.episodes) {
    report.files.push_back(
        {links.Videos(run.folder, episode.episode), links.Log(run.folder, episode.episode)});
  }
  std::vector<Choice> choices;
  for (const int episode : episodes) choices.push_back({episode, ""});
  if (episodes.empty()) choices = ChooseEpisodes(run, in_suite ? 1 : kFailuresDrawn);
  if (in_suite) choices.resize(std::min<size_t>(choices.size(), 1));
  report.run = std::move(run);
  AddCurves(choices, !episodes.empty(), &report);
  if (in_suite) {
    for (ReportCurves& curves : report.curves) {
      curves.figures.resize(std::min(curves.figures.size(), kFiguresInSuite));
    }
  }
  return report;
}

void AddCircumstances(Report* report) {
  std::vector<const results::RecordedRun*> runs;
  for (const ReportRun& run : report->runs) runs.push_back(&run.run);
  std::vector<results::RunCircumstances> found = results::FindCircumstances(runs);
  for (size_t k = 0; k < found.size(); ++k) report->runs[k].circumstances = std::move(found[k]);
}

// Adds images of the decisive moments of failures, at most kMaxStills in all.
void AddStills(Report* report) {
  const size_t of_each = std::max<size_t>(1, kMaxStills / report->runs.size());
  size_t left = kMaxStills;
  std::optional<StillRenderer> renderer;
  for (ReportRun& run : report->runs) {
    size_t drawn = 0;
    for (const results::RecordedEpisode& episode : run.run.episodes) {
      if (drawn == of_each || left == 0) break;
      if (!episode.complete || episode.success || !episode.judged() || episode.cause.text.empty()) continue;
      if (!renderer) renderer.emplace();
      ++drawn;
      --left;
      try {
        run.moments[episode.episode].image =
            renderer->DrawMoment(run.run.folder, episode.episode, episode.cause.time_s);
      } catch (const InputError& error) {
        run.image_remarks.push_back(fmt::format("no image of episode {}: {}", episode.episode, error.what()));
      }
    }
  }
}

// Links the failures to their decisive moments in the page's viewer, which initially shows the first failure
// that the page contains. has: returns whether the page contains an episode.
void LinkMoments(const std::function<bool(int run, int episode)>& has, Report* report) {
  report->opened.clear();
  for (size_t k = 0; k < report->runs.size(); ++k) {
    ReportRun& run = report->runs[k];
    for (const results::RecordedEpisode& episode : run.run.episodes) {
      if (!episode.complete || episode.success || !episode.judged()) continue;
      const PlayerPlace place{static_cast<int>(k), episode.episode};
      const std::string url = has(place.run, place.episode) ? PlayerUrl(place, episode.cause) : "";
      if (report->opened.empty()) report->opened = url;
      run.moments[episode.episode].url = url;
    }
  }
}

// Packs `episodes` into the page; if empty, first episodes with curves, then failures, then successes. The
// runs of a suite take turns, one episode at a time. Returns a sentence about the packed episodes.
std::string AddViewer(const std::vector<int>& episodes, size_t most, const PageLinks& links, Report* report) {
  ViewerPack pack(links);
  std::vector<std::vector<int>> order;
  size_t longest = 0;
  for (const ReportRun& run : report->runs) {
    pack.Add(run.run);
    std::vector<int> first;
    for (const ReportCurves& curves : run.curves) first.push_back(curves.episode);
    order.push_back(episodes.empty() ? FailuresFirst(run.run, first) : episodes);
    longest = std::max(longest, order.back().size());
  }
  std::vector<std::vector<ViewerPack::Wanted>> wanted;
  for (size_t k = 0; k < longest; ++k) {
    for (size_t run = 0; run < order.size(); ++run) {
      if (k < order[run].size()) wanted.push_back({{static_cast<int>(run), order[run][k]}});
    }
  }
  // All failures get links first, so that the size of the page is not underestimated.
  LinkMoments([](int, int) { return true; }, report);
  pack.Pack(wanted, ReportPage(*report).size(), most);
  for (const std::string& remark : pack.remarks()) report->viewer_remarks.push_back(remark);
  constexpr int kMaxLogRemarks = 3;
  int damaged = 0;
  for (size_t k = 0; k < report->runs.size(); ++k) {
    const results::RecordedRun& run = report->runs[k].run;
    for (const results::RecordedEpisode& episode : run.episodes) {
      // Logs of invalid episodes may be incomplete.
      if (!episode.complete || !pack.has(static_cast<int>(k), episode.episode)) continue;
      const std::string remark = LogRemark(run, episode.episode);
      if (!remark.empty() && ++damaged <= kMaxLogRemarks) report->viewer_remarks.push_back(remark);
    }
  }
  if (damaged > kMaxLogRemarks) {
    report->viewer_remarks.push_back(
        fmt::format("{} more logs are damaged or incomplete", damaged - kMaxLogRemarks));
  }
  report->viewer = pack.Viewer();
  LinkMoments([&](int run, int episode) { return pack.has(run, episode); }, report);
  return pack.Note();
}

}  // namespace

BuiltPage RunReport(results::RecordedRuns runs, const std::filesystem::path& file,
                    const std::vector<int>& episodes, const std::string& made_by, size_t most,
                    const CommandOf& command_of) {
  const PageLinks links(file);
  Report report;
  report.made_by = made_by;
  report.source = {{"page", kReportPage},
                   {"folder", RelativeToPage(runs.folder, file)},
                   {"name", runs.name},
                   {"episodes", episodes}};
  report.title = TitleOf(runs);
  for (results::RecordedRun& run : runs.runs) {
    report.runs.push_back(Describe(std::move(run), episodes, runs.is_suite, links, command_of));
  }
  AddCircumstances(&report);
  for (const std::string& missing : runs.missing) report.remarks.push_back(missing + ": no finished episode");
  std::string note;
  if (most > 0) {
    AddStills(&report);
    note = AddViewer(episodes, most, links, &report);
  }
  return {ReportPage(report), note, report.viewer_remarks};
}

}  // namespace evalbus::report
