#include "cli/live_view.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace evalbus {
namespace {

constexpr auto kRedrawPeriod = std::chrono::milliseconds(100);
// Until an episode has finished, nobody knows how long they are; a guess for the progress bar only.
constexpr double kTypicalEpisode = 10;  // s, simulated

double SecondsBetween(SteadyTime from, SteadyTime to) {
  return std::chrono::duration<double>(to - from).count();
}

double Sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::string StageCount(const metric_values_t& metrics) {
  const auto reached = std::count(metrics.stage_reached.begin(), metrics.stage_reached.end(), 1);
  return fmt::format("{}/{}", reached, metrics.num_stages);
}

std::string Clearance(const extended_metrics_t& extended) {
  return extended.has_clearance ? fmt::format("{:.0f} mm", extended.min_clearance_m * 1e3) : "-";
}

// Length in characters of UTF-8 text.
size_t Width(const std::string& text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string Cut(const std::string& text, size_t width) {
  size_t characters = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if ((text[i] & 0xC0) != 0x80 && ++characters > width) return text.substr(0, i);
  }
  return text;
}

std::string Bar(double fraction, int width) {
  const int full = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * width));
  std::string bar;
  for (int i = 0; i < width; ++i) bar += i < full ? "━" : "─";
  return bar;
}

struct Row {
  const char* metric;
  const char* label;
  const char* unit;
  // Shown value = value * scale.
  double scale;
};

// In the order of the questions people ask: how long, how far, how clean, how smooth.
constexpr std::array kRows = {
    Row{"completion_time", "completion time", "s", 1},
    Row{"subtask_progress", "subtask progress", "%", 100},
    Row{"slip_count", "slips", "", 1},
    Row{"env_collision_count", "collisions with the scene", "", 1},
    Row{"self_collision_count", "self collisions", "", 1},
    Row{"extended.min_clearance_m", "smallest clearance", "mm", 1e3},
    Row{"cartesian_path_length", "wrist path", "m", 1},
    Row{"total_cartesian_path_length", "wrist path, both arms", "m", 1},
    Row{"joint_path_length", "joint path", "rad", 1},
    Row{"total_joint_path_length", "joint path, both arms", "rad", 1},
    Row{"bimanual_arm_velocity_difference", "arm speed difference", "rad/s", 1},
    Row{"bimanual_gripper_vertical_difference", "gripper height difference", "mm", 1e3},
    Row{"rms_cartesian_jerk", "wrist jerk, rms", "m/s³", 1},
    Row{"overall_rms_cartesian_jerk", "wrist jerk, rms", "m/s³", 1},
    Row{"rms_joint_jerk", "joint jerk, rms", "rad/s³", 1},
    Row{"overall_rms_joint_jerk", "joint jerk, rms", "rad/s³", 1},
};

// Four significant digits, never in exponential form for the sizes met here.
std::string Number(double value, bool is_count = false) {
  if (!std::isfinite(value)) return "-";
  if (is_count && value == std::floor(value)) return fmt::format("{:.0f}", value);
  const double magnitude = std::abs(value);
  const int decimals = magnitude >= 999.95 ? 0 : magnitude >= 99.995 ? 1 : magnitude >= 9.9995 ? 2 : 3;
  return fmt::format("{:.{}f}", value, decimals);
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

std::string Pad(const std::string& text, int width) {
  const std::string space(static_cast<size_t>(std::max(0, std::abs(width) - static_cast<int>(Width(text)))),
                          ' ');
  return width < 0 ? text + space : space + text;
}

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

std::string EpisodeLine(const episode_summary_t& episode, int width) {
  const metric_values_t& m = episode.metrics;
  std::string line =
      ColumnLine({std::to_string(episode.header.episode), episode.end_reason,
                  fmt::format("{:.2f} s", m.completion_time_s), StageCount(m), std::to_string(m.slip_count),
                  fmt::format("{} + {}", m.env_collision_count, m.self_collision_count),
                  Clearance(episode.extended), fmt::format("{:.2f} m", Sum(m.cartesian_path_length_m))},
                 width);
  if (!episode.complete) line += "  incomplete";
  if (!episode.end_detail.empty()) line += "  " + episode.end_detail;
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

std::string SummaryTable(const run_summary_t& summary, int width) {
  std::string text;
  if (summary.num_complete > 0) {
    const std::string rate = fmt::format("Success in {} of {} episodes: {:.0f} %", summary.num_success,
                                         summary.num_complete, summary.success_rate * 100);
    const std::string interval =
        fmt::format("(95 % interval {:.0f} to {:.0f} %, Wilson)", summary.success_rate_lower * 100,
                    summary.success_rate_upper * 100);
    const bool one_line = static_cast<int>(rate.size() + 1 + interval.size()) <= width;
    text += rate + (one_line ? " " : "\n") + interval + "\n";
  }
  if (summary.num_complete < summary.num_episodes) {
    text += fmt::format("{} of {} episodes incomplete: left out of all this\n",
                        summary.num_episodes - summary.num_complete, summary.num_episodes);
  }
  if (summary.num_complete == 0) return text;

  constexpr int kLabelWidth = 25, kValueWidth = 9, kUnitWidth = 8;
  const std::array<std::pair<const char*, const std::vector<double>*>, 5> statistics = {
      {{"mean", &summary.mean_mixed},
       {"std", &summary.std_mixed},
       {"median", &summary.median_mixed},
       {"min", &summary.min_mixed},
       {"max", &summary.max_mixed}}};
  const auto shown = static_cast<size_t>(std::clamp((width - kLabelWidth - kUnitWidth) / kValueWidth, 1, 5));
  text += "\n" + std::string(kLabelWidth, ' ');
  for (size_t s = 0; s < shown; ++s) text += Pad(statistics[s].first, kValueWidth);
  text += "\n";
  for (const Row& row : kRows) {
    const auto found = std::find(summary.metric_name.begin(), summary.metric_name.end(), row.metric);
    if (found == summary.metric_name.end()) continue;
    const auto i = static_cast<size_t>(found - summary.metric_name.begin());
    text += Pad(row.label, -kLabelWidth);
    const bool is_count = *row.unit == '\0' || *row.unit == '%';
    for (size_t s = 0; s < shown; ++s) {
      text += Pad(Number((*statistics[s].second)[i] * row.scale, is_count), kValueWidth);
    }
    text += *row.unit ? fmt::format("  {}\n", row.unit) : "\n";
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

void LiveView::OnEpisodeDone(const episode_summary_t& episode, const run_summary_t& so_far) {
  so_far_ = so_far;
  simulated_s_ += episode.metrics.completion_time_s;
  has_partial_ = false;
  Print(EpisodeLine(episode, TerminalWidth(out_)));
}

void LiveView::OnRetry(int episode, const std::string& why) {
  has_partial_ = false;
  Print(fmt::format("{:>7}  begun again: {}", episode, why));
}

double LiveView::Progress() const {
  const double typical = so_far_.num_episodes > 0 ? simulated_s_ / so_far_.num_episodes : kTypicalEpisode;
  const double current =
      has_partial_ ? std::min(0.99, partial_.metrics.completion_time_s / std::max(typical, 1e-3)) : 0;
  return std::min(1.0, (so_far_.num_episodes + current) / std::max(1, header_.episodes));
}

std::vector<std::string> LiveView::Lines(int width, SteadyTime now) const {
  const double elapsed = SecondsBetween(started_, now);
  const double progress = Progress();
  const int bar_width = std::clamp(width - 40, 5, 20);
  std::string first =
      fmt::format("episode {} of {}  {} {:.0f} %", std::min(so_far_.num_episodes + 1, header_.episodes),
                  header_.episodes, Bar(progress, bar_width), progress * 100);
  if (progress > 0.02) first += fmt::format("  {} left", FormatDuration(elapsed * (1 / progress - 1)));
  std::vector<std::string> lines = {"", first};
  const auto add = [&](const std::string& label, const std::string& text) {
    lines.push_back("  " + Pad(label, -12) + text);
  };
  if (so_far_.num_complete > 0) {
    add("success",
        fmt::format("{} of {}, 95 % interval {:.0f} to {:.0f} %", so_far_.num_success, so_far_.num_complete,
                    so_far_.success_rate_lower * 100, so_far_.success_rate_upper * 100));
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
    if (Width(line) > static_cast<size_t>(width)) line = Cut(line, static_cast<size_t>(width));
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

}  // namespace evalbus
