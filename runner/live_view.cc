#include "runner/live_view.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "base/styled_text.h"
#include "base/text.h"
#include "lcmtypes/clock.h"
#include "results/summary_table.h"
#include "viz/terminal/terminal.h"
#include "viz/watch/score_rows.h"

namespace evalbus::runner {
namespace {

using viz::TerminalWidth;

constexpr auto kRedrawPeriod = std::chrono::milliseconds(100);
constexpr auto kSourceDelay = std::chrono::seconds(2);
// Assumed duration of an episode until the first one has finished; used only for the progress bar.
constexpr double kTypicalEpisode = 10;  // s, simulated

double SecondsBetween(SteadyTime from, SteadyTime to) {
  return std::chrono::duration<double>(to - from).count();
}

std::string Bar(double fraction, int width) {
  const int full = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * width));
  std::string bar;
  for (int i = 0; i < width; ++i) bar += i < full ? "━" : "─";
  return bar;
}

std::string Row(const std::string& label, const std::string& value, const std::string& rest) {
  constexpr int kLabel = 27, kValue = 8;
  const std::string row = "  " + Pad(label, -kLabel) + Pad(value, kValue) + " " + rest;
  return row.substr(0, row.find_last_not_of(' ') + 1);
}

// Adds lines with the scores of the current episode.
void AddScores(const viz::RunWatch& watch, std::vector<std::string>* lines) {
  const metric_values_t& m = watch.scores()->metrics;
  const extended_metrics_t& e = watch.scores()->extended;
  const std::string speed = watch.has_rates() ? viz::SpeedText(watch.speed()) : "-";
  lines->push_back(Row("time", fmt::format("{:.2f}", m.completion_time_s), "s   " + speed + " x real time"));
  for (const viz::StageRow& stage : viz::StageRows(m, e)) {
    const bool has_time = stage.reached && stage.time >= 0;
    lines->push_back(Row(fmt::format("{} {}", viz::StageMark(stage.reached), stage.name),
                         has_time ? fmt::format("{:.2f}", stage.time) : "", has_time ? "s" : ""));
  }
  const auto add = [&](const viz::ScoreRow& row) {
    lines->push_back(
        Row(row.label, ShownValue(*row.metric, row.value()), std::string(row.metric->shown_unit)));
  };
  for (const viz::ScoreRow& row : viz::ScoreRows(m, e)) {
    if (row.metric->kind == MetricKind::kByName) add(row);
  }
  for (const viz::ScoreRow& row : viz::FirstRows(m, e)) add(row);
}

}  // namespace

LiveView::LiveView(FILE* out, const LiveHeader& header, Clock clock)
    : out_(out),
      is_terminal_(isatty(fileno(out)) != 0),
      colors_(UsesColors(out)),
      header_(header),
      clock_(std::move(clock)),
      started_(clock_()) {
  if (header.there_before > 0 && !header.tells_those_before) return;
  const int width = viz::TerminalWidth(out_);
  const std::string what = fmt::format("{}/{}  policy {}", header.task, header.variation, header.policy);
  const std::string how = fmt::format("seed {}  {} {:g} Hz  {}", header.seed, header.clock, header.control_hz,
                                      Plural(header.episodes, "episode"));
  const bool one_line = static_cast<int>(Width(what) + 2 + Width(how)) <= width;
  fmt::print(out_, "{}{}{}\n{}\n", what, one_line ? "  " : "\n", how,
             header.is_blind ? "episodes wait for verdicts on the page" : results::EpisodeHeader(width));
  std::fflush(out_);
}

void LiveView::OnEpisodeBegin(const episode_begin_t& begin) {
  watch_.Receive(begin, clock_());
  watch_.TakeEvents();  // the line of a finished episode contains the events' outcome
  is_running_ = true;
}

void LiveView::OnPartial(const partial_metrics_t& partial) {
  waiting_since_.reset();
  watch_.Receive(partial, clock_());
}

void LiveView::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  const metrics::EpisodeResult result = metrics::ResultOf(episode);
  statistics_.Add(num_episodes_++, result);
  summary_.reset();
  if (result.complete && result.judged()) {
    num_successes_ += result.success;
    running_rate_.push_back(num_successes_ / static_cast<double>(running_rate_.size() + 1));
  }
  simulated_s_ += episode["metrics"]["completion_time"].get<double>();
  is_running_ = false;
  if (header_.clock == clock_name::kSource && num_episodes_ < header_.episodes) waiting_since_ = clock_();
  if (num_episodes_ <= header_.there_before && !header_.tells_those_before) return;
  PrintAbove(header_.is_blind ? fmt::format("episode {} has ended", episode["episode"].get<int>())
                              : results::EpisodeLine(episode, viz::TerminalWidth(out_), colors_));
}

double LiveView::Progress() const {
  const double typical = num_episodes_ > 0 ? simulated_s_ / num_episodes_ : kTypicalEpisode;
  const double current =
      has_scores() ? std::min(0.99, watch_.scores()->metrics.completion_time_s / std::max(typical, 1e-3)) : 0;
  return std::min(1.0, (num_episodes_ + current) / std::max(1, header_.episodes));
}

std::vector<std::string> LiveView::Lines(int width, SteadyTime now) {
  watch_.Update(now);
  const double elapsed = SecondsBetween(started_, now);
  const double progress = Progress();
  const int bar_width = std::clamp(width - 40, 5, 20);
  std::string first =
      fmt::format("episode {} of {}  {} {:.0f} %", std::min(num_episodes_ + 1, header_.episodes),
                  header_.episodes, Bar(progress, bar_width), progress * 100);
  // Fraction of the episodes that this process has run. The duration of earlier episodes is unknown.
  const double covered = progress - static_cast<double>(header_.there_before) / std::max(1, header_.episodes);
  if (covered > 0.02) {
    first += fmt::format("  {} left", results::FormatDuration(elapsed / covered * (1 - progress)));
  }
  std::vector<std::string> lines = {"", first};
  // The summary is computed only for drawing, because it iterates over all episodes.
  if (!summary_) summary_ = statistics_.Summary(false);
  if (summary_->judged > 0 && !header_.is_blind) {
    constexpr int kSparkline = 20;
    lines.push_back(fmt::format(
        "  success  {} of {}, {}  {}", summary_->successes, summary_->judged,
        viz::AnytimeRateText(summary_->success_rate, summary_->anytime.lower, summary_->anytime.upper),
        Sparkline(running_rate_, kSparkline)));
  }
  if (has_scores() && !header_.is_blind) AddScores(watch_, &lines);
  for (std::string& line : lines) line = Cut(Printable(line), width);
  return lines;
}

std::vector<std::string> LiveView::LinesThatFit(SteadyTime now) {
  const auto [columns, rows] = viz::TerminalSize(fileno(out_));
  std::vector<std::string> lines = Lines(columns, now);
  // The lines are limited, because a display taller than the terminal would scroll at each redraw.
  lines.resize(std::min<size_t>(lines.size(), static_cast<size_t>(std::max(2, rows - 1))));
  return lines;
}

// Writes all lines in one call and overwrites each line in place, to avoid flicker.
void LiveView::Draw(const std::string& above, const std::vector<std::string>& live) {
  std::string text = drawn_lines_ > 0 ? fmt::format("\x1b[{}F", drawn_lines_) : "";
  const char* end_of_line = is_terminal_ ? "\x1b[K\n" : "\n";
  if (!above.empty()) text += above + end_of_line;
  for (const std::string& line : live) text += line + end_of_line;
  if (is_terminal_ && drawn_lines_ > 0) text += "\x1b[J";
  std::fwrite(text.data(), 1, text.size(), out_);
  std::fflush(out_);
  drawn_lines_ = static_cast<int>(live.size());
}

void LiveView::Print(const std::string& line) { PrintAbove(Printable(line)); }

void LiveView::PrintAbove(const std::string& printable) {
  Draw(printable, is_terminal_ ? LinesThatFit(clock_()) : std::vector<std::string>());
}

void LiveView::Poll(SteadyTime now) {
  if (waiting_since_ && now - *waiting_since_ >= kSourceDelay) {
    waiting_since_.reset();
    PrintAbove(fmt::format("waiting for the source's next episode ({} of {} finished); Ctrl-C stops",
                           num_episodes_, header_.episodes));
  }
  if (!is_terminal_ || now - drawn_ < kRedrawPeriod) return;
  drawn_ = now;
  Draw("", LinesThatFit(now));
}

void LiveView::Finish() {
  if (drawn_lines_ > 0) Draw("", {});
}

}  // namespace evalbus::runner
