#include "cli/live_view.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
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
std::string Number(double value) {
  if (!std::isfinite(value)) return "-";
  const double magnitude = std::abs(value);
  const int decimals = magnitude >= 999.95 ? 0 : magnitude >= 99.995 ? 1 : magnitude >= 9.9995 ? 2 : 3;
  return value == std::floor(value) && magnitude < 1e6 ? fmt::format("{:.0f}", value)
                                                       : fmt::format("{:.{}f}", value, decimals);
}

constexpr char kEpisodeHeader[] =
    "episode  end              time  stages  slips  collisions  clearance    path";

std::string EpisodeLine(const episode_summary_t& episode) {
  const metric_values_t& m = episode.metrics;
  std::string line = fmt::format("{:>7}  {:<14} {:>5.2f} s  {:>6}  {:>5}  {:>4} + {:<3}  {:>9}  {:>4.2f} m",
                                 episode.header.episode, episode.end_reason, m.completion_time_s,
                                 StageCount(m), m.slip_count, m.env_collision_count, m.self_collision_count,
                                 Clearance(episode.extended), Sum(m.cartesian_path_length_m));
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

std::string SummaryTable(const run_summary_t& summary) {
  std::string text;
  if (summary.num_complete > 0) {
    text += fmt::format("Success in {} of {} episodes: {:.0f} % (95 % interval {:.0f} to {:.0f} %, Wilson)\n",
                        summary.num_success, summary.num_complete, summary.success_rate * 100,
                        summary.success_rate_lower * 100, summary.success_rate_upper * 100);
  }
  if (summary.num_complete < summary.num_episodes) {
    text += fmt::format("{} incomplete episodes are left out of the rate and of the table\n",
                        summary.num_episodes - summary.num_complete);
  }
  if (summary.num_complete == 0) return text;
  text += fmt::format("\n{:<28}{:>10}{:>10}{:>10}{:>10}{:>10}\n", "", "mean", "std", "median", "min", "max");
  for (const Row& row : kRows) {
    const auto found = std::find(summary.metric_name.begin(), summary.metric_name.end(), row.metric);
    if (found == summary.metric_name.end()) continue;
    const auto i = static_cast<size_t>(found - summary.metric_name.begin());
    const auto cell = [&](const std::vector<double>& values) { return Number(values[i] * row.scale); };
    text += fmt::format("{:<28}{:>10}{:>10}{:>10}{:>10}{:>10}  {}\n", row.label, cell(summary.mean_mixed),
                        cell(summary.std_mixed), cell(summary.median_mixed), cell(summary.min_mixed),
                        cell(summary.max_mixed), row.unit);
  }
  return text;
}

LiveView::LiveView(FILE* out, const LiveHeader& header)
    : out_(out),
      is_terminal_(isatty(fileno(out)) != 0),
      header_(header),
      started_(std::chrono::steady_clock::now()) {
  fmt::print(out_, "{}/{}  policy {}  seed {}  {} {:g} Hz  {} episode{}\n", header.task, header.variation,
             header.policy, header.seed, header.clock, header.control_hz, header.episodes,
             header.episodes == 1 ? "" : "s");
  fmt::print(out_, "{}\n", kEpisodeHeader);
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
  Erase();
  fmt::print(out_, "{}\n", EpisodeLine(episode));
  std::fflush(out_);
  so_far_ = so_far;
  simulated_s_ += episode.metrics.completion_time_s;
  has_partial_ = false;
}

void LiveView::OnRetry(int episode, const std::string& why) {
  Erase();
  fmt::print(out_, "{:>7}  begun again: {}\n", episode, why);
  std::fflush(out_);
  has_partial_ = false;
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
  std::string first =
      fmt::format("episode {} of {}  {} {:.0f} %", std::min(so_far_.num_episodes + 1, header_.episodes),
                  header_.episodes, Bar(progress, 20), progress * 100);
  if (progress > 0.02) first += fmt::format("  about {} left", FormatDuration(elapsed * (1 / progress - 1)));
  if (so_far_.num_complete > 0)
    first += fmt::format("  {} of {} succeeded", so_far_.num_success, so_far_.num_complete);
  std::vector<std::string> lines = {"", first};
  if (has_partial_) {
    const metric_values_t& m = partial_.metrics;
    const double wall = SecondsBetween(episode_started_, now);
    lines.push_back(fmt::format("  time       {:6.2f} s   {:.1f} x real time", m.completion_time_s,
                                wall > 0 ? m.completion_time_s / wall : 0));
    for (size_t k = 0; k < m.stage_name.size(); ++k) {
      const double when = partial_.extended.stage_time_s[k];
      lines.push_back(fmt::format("  stage {}   {} {}{}", m.stage_index[k], m.stage_reached[k] ? "●" : "○",
                                  m.stage_name[k],
                                  m.stage_reached[k] && when >= 0 ? fmt::format("  at {:.2f} s", when) : ""));
    }
    for (size_t k = 0; k < m.target_distance_name.size(); ++k) {
      lines.push_back(
          fmt::format("  distance   {:6.3f} m   {}", m.target_distance_m[k], m.target_distance_name[k]));
    }
    lines.push_back(fmt::format("  slips      {:<5} collisions {} scene, {} self   clearance {}",
                                m.slip_count, m.env_collision_count, m.self_collision_count,
                                Clearance(partial_.extended)));
    lines.push_back(fmt::format(
        "  path       {:5.2f} m   jerk {} m/s³ rms", Sum(m.cartesian_path_length_m),
        Number(m.num_arms == 1 ? m.rms_cartesian_jerk_mps3[0] : m.overall_rms_cartesian_jerk_mps3)));
  }
  for (std::string& line : lines) {
    if (Width(line) > static_cast<size_t>(width)) line = Cut(line, static_cast<size_t>(width));
  }
  return lines;
}

void LiveView::Erase() {
  // Up to the first live line, then clear to the end of the screen.
  if (drawn_lines_ > 0) fmt::print(out_, "\x1b[{}F\x1b[0J", drawn_lines_);
  drawn_lines_ = 0;
}

void LiveView::Poll(SteadyTime now) {
  if (!is_terminal_ || now - drawn_ < kRedrawPeriod) return;
  drawn_ = now;
  winsize size{};
  const bool known = ioctl(fileno(out_), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  std::vector<std::string> lines = Lines(known ? size.ws_col : 80, now);
  // A terminal lower than the display would scroll at each redraw.
  if (known && lines.size() > static_cast<size_t>(std::max(2, size.ws_row - 1))) {
    lines.resize(static_cast<size_t>(std::max(2, size.ws_row - 1)));
  }
  Erase();
  for (const std::string& line : lines) fmt::print(out_, "{}\n", line);
  std::fflush(out_);
  drawn_lines_ = static_cast<int>(lines.size());
}

void LiveView::Finish() {
  Erase();
  std::fflush(out_);
}

}  // namespace evalbus
