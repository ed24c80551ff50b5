#include "cli/launch/live_view.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "base/text.h"
#include "lcmtypes/extended_value.h"
#include "lcmtypes/metric_catalogue.h"

namespace evalbus::launch {
namespace {

constexpr auto kRedrawPeriod = std::chrono::milliseconds(100);
// Until an episode has finished, nobody knows how long they are; a guess for the progress bar only.
constexpr double kTypicalEpisode = 10;  // s, simulated

double SecondsBetween(SteadyTime from, SteadyTime to) {
  return std::chrono::duration<double>(to - from).count();
}

double Sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::string Clearance(const extended_metrics_t& extended) {
  const double clearance = ExtendedValue(extended, "min_clearance_m");
  return std::isfinite(clearance) ? fmt::format("{:.0f} mm", clearance * 1e3) : "-";
}

std::string Bar(double fraction, int width) {
  const int full = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * width));
  std::string bar;
  for (int i = 0; i < width; ++i) bar += i < full ? "━" : "─";
  return bar;
}

// One line per finished episode: columns from the left as far as the terminal is wide.
struct Column {
  const char* title;
  // In characters; negative: text to the left.
  int width;
};
constexpr std::array kColumns = {Column{"episode", 7},   Column{"end", -14}, Column{"time", 7},
                                 Column{"stages", 6},    Column{"slips", 5}, Column{"collisions", 10},
                                 Column{"clearance", 9}, Column{"path", 7}};

std::string ColumnLine(const std::array<std::string, kColumns.size()>& cells, int width) {
  std::string line;
  for (size_t i = 0; i < kColumns.size(); ++i) {
    const std::string cell = (i > 0 ? "  " : "") + Pad(cells[i], kColumns[i].width);
    if (static_cast<int>(Width(line + cell)) > width) break;
    line += cell;
  }
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

std::string HeaderLine(int width) {
  std::array<std::string, kColumns.size()> titles;
  for (size_t i = 0; i < titles.size(); ++i) titles[i] = kColumns[i].title;
  return ColumnLine(titles, width);
}

// A number of the dictionary with its format; "-" where it is not tracked.
std::string Value(const nlohmann::ordered_json& values, const char* key, fmt::format_string<double> format,
                  double scale = 1) {
  const auto found = values.find(key);
  if (found == values.end() || !found->is_number()) return "-";
  return fmt::format(format, found->get<double>() * scale);
}

// From the episode's line of episodes.jsonl.
std::string EpisodeLine(const nlohmann::ordered_json& episode, int width) {
  const auto &m = episode["metrics"], &extended = episode["extended"];
  const auto stages = m.value("task_stage_reached", nlohmann::ordered_json::object());
  const auto reached = std::count_if(stages.begin(), stages.end(),
                                     [](const auto& stage) { return stage.template get<bool>(); });
  const char* path =
      m.contains("total_cartesian_path_length") ? "total_cartesian_path_length" : "cartesian_path_length";
  const auto reason = episode["failure_reason"].get<std::string>();
  std::string line = ColumnLine(
      {std::to_string(episode["episode"].get<int>()), reason.empty() ? "success" : reason,
       Value(m, "completion_time", "{:.2f} s"), fmt::format("{}/{}", reached, stages.size()),
       Value(m, "slip_count", "{:.0f}"),
       Value(m, "env_collision_count", "{:.0f}") + " + " + Value(m, "self_collision_count", "{:.0f}"),
       Value(extended, "min_clearance_m", "{:.0f} mm", 1e3), Value(m, path, "{:.2f} m")},
      width);
  if (!episode["complete"].get<bool>()) line += "  incomplete";
  const auto detail = episode["end_detail"].get<std::string>();
  if (!detail.empty()) line += "  " + detail;
  return line;
}

}  // namespace

std::string FormatDuration(double seconds) {
  const auto whole = static_cast<int64_t>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

int TerminalWidth(FILE* out) {
  winsize size{};
  if (isatty(fileno(out)) == 0) return std::numeric_limits<int>::max();
  return ioctl(fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::string SummaryTable(const metrics::RunSummary& summary, int width) {
  std::string text;
  if (summary.complete > 0) {
    const std::string rate = fmt::format("Success in {} of {} episodes: {:.0f} %", summary.successes,
                                         summary.complete, summary.success_rate * 100);
    const std::string interval = fmt::format("(95 % interval {:.0f} to {:.0f} %, Wilson)",
                                             summary.wilson.lower * 100, summary.wilson.upper * 100);
    const bool one_line = static_cast<int>(rate.size() + 1 + interval.size()) <= width;
    text += rate + (one_line ? " " : "\n") + interval + "\n";
  }
  if (summary.complete < summary.episodes) {
    text += fmt::format("{} of {} episodes incomplete: left out of all this\n",
                        summary.episodes - summary.complete, summary.episodes);
  }
  if (summary.complete == 0) return text;
  if (!summary.failure_reasons.empty()) {
    text += "Failures:";
    for (const auto& [reason, count] : summary.failure_reasons) {
      text += fmt::format("{} {} {}", text.ends_with(':') ? "" : ",", count, reason);
    }
    text += "\n";
  }

  // A statistic of a metric, as one column; the interval is wider than the others.
  struct Statistic {
    const char* title;
    int width;
    std::function<std::string(const metrics::MetricSummary&, const std::function<std::string(double)>&)> text;
  };
  const auto plain = [](double metrics::MetricSummary::*member) {
    return
        [member](const metrics::MetricSummary& metric, const auto& number) { return number(metric.*member); };
  };
  constexpr int kLabelWidth = 25, kValueWidth = 9, kIntervalWidth = 20, kUnitWidth = 8;
  const std::array statistics = {
      Statistic{"mean", kValueWidth, plain(&metrics::MetricSummary::mean)},
      Statistic{"its 95 % interval", kIntervalWidth,
                [](const metrics::MetricSummary& metric, const auto& number) {
                  const metrics::Interval& interval = metric.mean_95;
                  if (!std::isfinite(interval.lower)) return std::string("-");
                  return number(interval.lower) + " to" + Pad(number(interval.upper), 8);
                }},
      Statistic{"std", kValueWidth, plain(&metrics::MetricSummary::std)},
      Statistic{"median", kValueWidth, plain(&metrics::MetricSummary::median)},
      Statistic{"p5", kValueWidth, plain(&metrics::MetricSummary::p5)},
      Statistic{"p95", kValueWidth, plain(&metrics::MetricSummary::p95)},
      Statistic{"max", kValueWidth, plain(&metrics::MetricSummary::max)},
  };
  size_t shown = 0;
  for (int used = kLabelWidth + kUnitWidth; shown < statistics.size(); ++shown) {
    used += statistics[shown].width;
    if (used > width && shown > 0) break;
  }
  text += "\n" + std::string(kLabelWidth, ' ');
  for (size_t s = 0; s < shown; ++s) text += Pad(statistics[s].title, statistics[s].width);
  text += "\n";
  std::vector<std::string> names;
  for (const metrics::MetricSummary& metric : summary.metrics) names.push_back(metric.name);
  for (const MetricNumber& main : MainMetrics(names)) {
    const auto number = [&](double value) { return ShownValue(*main.metric, value); };
    text += Pad(main.label(), -kLabelWidth);
    for (size_t s = 0; s < shown; ++s) {
      text += Pad(statistics[s].text(*summary.Find(main.name), number), statistics[s].width);
    }
    text += main.shown_unit().empty() ? "\n" : fmt::format("  {}\n", main.shown_unit());
  }
  return text;
}

LiveView::LiveView(FILE* out, const LiveHeader& header)
    : out_(out),
      is_terminal_(isatty(fileno(out)) != 0),
      header_(header),
      started_(std::chrono::steady_clock::now()) {
  const int width = TerminalWidth(out_);
  const std::string what = fmt::format("{}/{}  policy {}", header.task, header.variation, header.policy);
  const std::string how = fmt::format("seed {}  {} {:g} Hz  {} episode{}", header.seed, header.clock,
                                      header.control_hz, header.episodes, header.episodes == 1 ? "" : "s");
  const bool one_line = static_cast<int>(Width(what) + 2 + Width(how)) <= width;
  fmt::print(out_, "{}{}{}\n{}\n", what, one_line ? "  " : "\n", how, HeaderLine(width));
  std::fflush(out_);
}

void LiveView::OnEpisodeBegin(const episode_begin_t& begin) {
  episode_ = begin.header.episode;
  episode_started_ = std::chrono::steady_clock::now();
  has_partial_ = false;
}

void LiveView::OnPartial(const partial_metrics_t& partial) {
  partial_ = partial;
  has_partial_ = true;
}

void LiveView::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  const metrics::EpisodeResult result = metrics::ResultOf(episode);
  ++num_episodes_;
  num_complete_ += result.complete;
  num_success_ += result.complete && result.success;
  simulated_s_ += episode["metrics"]["completion_time"].get<double>();
  has_partial_ = false;
  Print(EpisodeLine(episode, TerminalWidth(out_)));
}

double LiveView::Progress() const {
  const double typical = num_episodes_ > 0 ? simulated_s_ / num_episodes_ : kTypicalEpisode;
  const double current =
      has_partial_ ? std::min(0.99, partial_.metrics.completion_time_s / std::max(typical, 1e-3)) : 0;
  return std::min(1.0, (num_episodes_ + current) / std::max(1, header_.episodes));
}

std::vector<std::string> LiveView::Lines(int width, SteadyTime now) const {
  const double elapsed = SecondsBetween(started_, now);
  const double progress = Progress();
  const int bar_width = std::clamp(width - 40, 5, 20);
  std::string first =
      fmt::format("episode {} of {}  {} {:.0f} %", std::min(num_episodes_ + 1, header_.episodes),
                  header_.episodes, Bar(progress, bar_width), progress * 100);
  if (progress > 0.02) first += fmt::format("  {} left", FormatDuration(elapsed * (1 / progress - 1)));
  std::vector<std::string> lines = {"", first};
  const auto add = [&](const std::string& label, const std::string& text) {
    lines.push_back("  " + Pad(label, -12) + text);
  };
  if (num_complete_ > 0) {
    const metrics::Interval interval = metrics::WilsonInterval(num_success_, num_complete_);
    add("success", fmt::format("{} of {}, 95 % interval {:.0f} to {:.0f} %", num_success_, num_complete_,
                               interval.lower * 100, interval.upper * 100));
  }
  if (has_partial_) {
    const metric_values_t& m = partial_.metrics;
    const double wall = SecondsBetween(episode_started_, now);
    add("time", fmt::format("{:6.2f} s  {:.1f} x real time", m.completion_time_s,
                            wall > 0 ? m.completion_time_s / wall : 0));
    for (size_t k = 0; k < m.stage_name.size(); ++k) {
      const double when = partial_.extended.stage_time_s[k];
      const bool reached = m.stage_reached[k] != 0;
      add(fmt::format("stage {}", m.stage_index[k]),
          fmt::format("{} {}{}", reached ? "●" : "○", m.stage_name[k],
                      reached && when >= 0 ? fmt::format("  {:.2f} s", when) : ""));
    }
    for (size_t k = 0; k < m.target_distance_name.size(); ++k) {
      // No "-0.000".
      const double millimetres = std::round(m.target_distance_m[k] * 1e3) + 0.0;
      add("distance", fmt::format("{:6.3f} m  {}", millimetres * 1e-3, m.target_distance_name[k]));
    }
    add("clearance", Pad(Clearance(partial_.extended), 8));
    add("collisions", fmt::format("{} scene, {} self, {} slips", m.env_collision_count,
                                  m.self_collision_count, m.slip_count));
    add("path", fmt::format("{:6.2f} m  jerk {} m/s³ rms", Sum(m.cartesian_path_length_m),
                            Number(m.num_arms == 1 ? m.rms_cartesian_jerk_mps3[0]
                                                   : m.overall_rms_cartesian_jerk_mps3)));
  }
  for (std::string& line : lines) {
    line = Cut(line, width);
  }
  return lines;
}

std::vector<std::string> LiveView::LinesThatFit(SteadyTime now) const {
  winsize size{};
  std::vector<std::string> lines = Lines(TerminalWidth(out_), now);
  // A terminal lower than the display would scroll at each redraw.
  if (ioctl(fileno(out_), TIOCGWINSZ, &size) == 0 && size.ws_row > 0)
    lines.resize(std::min<size_t>(lines.size(), std::max(2, size.ws_row - 1)));
  return lines;
}

// Everything in one write, each line over the one that was there: what does not change does not flicker.
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

void LiveView::Print(const std::string& line) {
  Draw(line, is_terminal_ ? LinesThatFit(std::chrono::steady_clock::now()) : std::vector<std::string>());
}

void LiveView::Poll(SteadyTime now) {
  if (!is_terminal_ || now - drawn_ < kRedrawPeriod) return;
  drawn_ = now;
  Draw("", LinesThatFit(now));
}

void LiveView::Finish() {
  if (drawn_lines_ > 0) Draw("", {});
}

}  // namespace evalbus::launch
