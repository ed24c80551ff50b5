#include "results/summary_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/help.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalog.h"

namespace evalbus::results {
namespace {

// A column of the line for a finished episode. Columns that do not fit into the terminal are omitted.
struct Column {
  const char* title;
  // Width in characters; a negative width means left-aligned.
  int width;
};
constexpr std::array kColumns = {Column{"episode", 7},   Column{"end", -24}, Column{"time", 7},
                                 Column{"stages", 6},    Column{"slips", 5}, Column{"collisions", 10},
                                 Column{"clearance", 9}, Column{"path", 7}};

constexpr size_t kEndColumn = 1;

// Returns the number of columns that fit into `width`.
size_t NumEpisodeColumns(int width) {
  size_t shown = 0;
  for (int used = -2; shown < kColumns.size(); ++shown) {
    used += 2 + std::abs(kColumns[shown].width);
    if (used > width) break;
  }
  return shown;
}

// Returns a line with the cells that fit into `width`. end: style of the cell with the end reason.
std::string ColumnLine(const std::array<std::string, kColumns.size()>& cells, int width, Style end,
                       bool colors) {
  std::string line;
  for (size_t i = 0; i < NumEpisodeColumns(width); ++i) {
    const std::string cell = (i > 0 ? "  " : "") + Pad(cells[i], kColumns[i].width);
    line += Styled(cell, i == kEndColumn ? end : Style::kPlain, colors);
  }
  return line.substr(0, line.find_last_not_of(' ') + 1);
}

// Formats a value with the given number of decimals and its unit; "-" if the value is missing.
std::string Value(const nlohmann::ordered_json& values, const char* key, int decimals = 0,
                  const std::string& unit = "", double scale = 1) {
  const auto found = values.find(key);
  if (found == values.end() || !found->is_number()) return "-";
  return WithUnit(Fixed(found->get<double>() * scale, decimals), unit);
}

// A column for a statistic of a metric. Columns for intervals are wider.
struct Statistic {
  const char* title;
  int width;
  std::function<std::string(const metrics::MetricSummary&, const std::function<std::string(double)>&)> text;
};

std::vector<Statistic> Statistics() {
  using metrics::MetricSummary;
  constexpr int kWidth = 9, kIntervalWidth = 20;
  const auto plain = [](double MetricSummary::*member) {
    return [member](const MetricSummary& metric, const auto& number) { return number(metric.*member); };
  };
  const auto interval = [](const MetricSummary& metric, const auto& number) {
    if (!std::isfinite(metric.mean_95.lower)) return std::string("-");
    return number(metric.mean_95.lower) + " to" + Pad(number(metric.mean_95.upper), 8);
  };
  return {{"mean", kWidth, plain(&MetricSummary::mean)}, {"95 % CI of mean", kIntervalWidth, interval},
          {"std", kWidth, plain(&MetricSummary::std)},   {"median", kWidth, plain(&MetricSummary::median)},
          {"p5", kWidth, plain(&MetricSummary::p5)},     {"p95", kWidth, plain(&MetricSummary::p95)},
          {"max", kWidth, plain(&MetricSummary::max)}};
}

std::string RateText(const metrics::RunSummary& summary, int width, bool colors) {
  if (summary.judged == 0) return "Success was not judged: poses of objects are missing\n";
  const std::string rate = fmt::format("Success in {} of {} {}episode{}: {}", summary.successes,
                                       summary.judged, summary.judged < summary.complete ? "judged " : "",
                                       summary.judged == 1 ? "" : "s", Percent(summary.success_rate));
  const std::string interval = fmt::format("(95 % interval {}, Wilson)", PercentText(summary.wilson));
  const bool one_line = static_cast<int>(rate.size() + 1 + interval.size()) <= width;
  return Styled(rate, Style::kStrong, colors) + (one_line ? " " : "\n") + interval + "\n";
}

// Returns true if there are several episodes, and the metric has the same value in all of them.
bool IsConstant(const metrics::MetricSummary& metric) {
  return metric.episodes > 1 && metric.min == metric.max && !IsOfSuccessesOnly(metric.name);
}

// Returns a paragraph on the metrics that are equal in every episode; empty if there are none.
std::string ConstantsText(const std::vector<MetricNumber>& constants, const metrics::RunSummary& summary,
                          int width) {
  std::vector<std::string> parts;
  for (const MetricNumber& number : constants) {
    parts.push_back(number.label() + " " + ShownWithUnit(*number.metric, summary.Find(number.name)->mean));
  }
  if (parts.empty()) return "";
  return Wrapped(fmt::format("equal in every episode: {}", fmt::join(parts, "; ")), 2,
                 static_cast<size_t>(width)) +
         "\n";
}

// Returns a line with the statistics and the columns of episodes that do not fit into `width`. shown: number
// of statistics that fit.
std::string OmittedFromRunText(const std::vector<Statistic>& statistics, size_t shown, int width) {
  std::vector<std::string> parts;
  const auto add = [&parts](const auto& columns, size_t first, const char* file) {
    std::vector<std::string> titles;
    for (size_t i = first; i < columns.size(); ++i) titles.emplace_back(columns[i].title);
    if (!titles.empty()) parts.push_back(fmt::format("{} (see {})", fmt::join(titles, ", "), file));
  };
  add(statistics, shown, kSummaryJson);
  add(kColumns, NumEpisodeColumns(width), kEpisodesJsonl);
  return OmittedColumnsText(parts, width);
}

// Returns a line such as " 2 violations of force limits, first of pot at 5.62 s with 604 N"; empty if there
// are none.
std::string ViolationsText(const nlohmann::ordered_json& episode) {
  const auto list = nlohmann::ordered_json::json_pointer("/explanation/limit_violations");
  if (!episode.contains(list)) return "";
  const nlohmann::ordered_json& first = episode[list][0];
  return fmt::format("  {} of force limits, first of {} at {:.2f} s with {:.0f} N",
                     Plural(episode[list].size(), "violation"), Printable(first["region"].get<std::string>()),
                     first["time_s"].get<double>(), first["force_N"].get<double>());
}

// Returns a line with the command that shows a failed episode, and the sentence on its cause. label: begins
// the line.
std::string FailureText(const std::string& label, const std::string& folder, const FailedEpisode& failed,
                        int width, bool colors) {
  std::string text =
      fmt::format("{}  {}  {}\n", label,
                  Styled(Pad(end_reason::Text(Printable(failed.reason)), kColumns[kEndColumn].width),
                         Style::kBad, colors),
                  ShellWords({"evalbus", "web", folder, "--episode", std::to_string(failed.episode)}));
  if (failed.cause.text.empty()) return text;
  const auto indent = static_cast<size_t>(Width(label) + 2);
  return text + std::string(indent, ' ') +
         Wrapped(Printable(failed.cause.text), indent, static_cast<size_t>(width)) + "\n";
}

}  // namespace

std::string FormatDuration(double seconds) {
  const auto whole = static_cast<int64_t>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string PercentText(const metrics::Interval& interval) {
  const int decimals = interval.upper - interval.lower < 0.02 ? 1 : 0;
  return fmt::format("{:.{}f} to {:.{}f} %", interval.lower * 100, decimals, interval.upper * 100, decimals);
}

std::string OmittedColumnsText(const std::vector<std::string>& columns, int width) {
  if (columns.empty()) return "";
  const std::string text = fmt::format("not shown at {} columns: {}", width, fmt::join(columns, "; "));
  return Wrapped(text, 2, static_cast<size_t>(width)) + "\n";
}

std::string SuccessText(const std::string& cause, int most) {
  const size_t at = cause.find(": ");
  if (at == std::string::npos) return "";
  const std::string conditions = cause.substr(at + 2, cause.size() - at - 3);  // without the period
  return Width(conditions) <= most ? conditions : conditions.substr(0, conditions.find(", "));
}

std::string EpisodeHeader(int width) {
  std::array<std::string, kColumns.size()> titles;
  for (size_t i = 0; i < titles.size(); ++i) titles[i] = kColumns[i].title;
  return ColumnLine(titles, width, Style::kPlain, false);
}

std::string EpisodeLine(const nlohmann::ordered_json& episode, int width, bool colors) {
  const auto &m = episode["metrics"], &extended = episode["extended"];
  const auto stages = m.value("task_stage_reached", nlohmann::ordered_json::object());
  const auto reached = std::count_if(stages.begin(), stages.end(),
                                     [](const auto& stage) { return stage.template get<bool>(); });
  const char* path =
      m.contains("total_cartesian_path_length") ? "total_cartesian_path_length" : "cartesian_path_length";
  const auto reason = episode["failure_reason"].get<std::string>();
  std::string line =
      ColumnLine({std::to_string(episode["episode"].get<int>()), end_reason::Outcome(reason),
                  Value(m, "completion_time", 2, "s"),
                  stages.empty() ? "-" : fmt::format("{}/{}", reached, stages.size()), Value(m, "slip_count"),
                  Value(m, "env_collision_count") + " + " + Value(m, "self_collision_count"),
                  Value(extended, "min_clearance_m", 0, "mm", 1e3), Value(m, path, 2, "m")},
                 width, reason.empty() ? Style::kGood : Style::kBad, colors);
  if (episode["end_reason"] == end_reason::kServerError) {
    line += "  invalid";
  } else if (!episode["complete"].get<bool>()) {
    line += "  incomplete";
  }
  const auto detail = episode["end_detail"].get<std::string>();
  if (!detail.empty()) line += "  " + Printable(detail);
  const auto cause = nlohmann::ordered_json::json_pointer("/cause/text");
  if (reason.empty() && episode.contains(cause)) {
    const int codes = Width(Styled(" ", Style::kGood, colors)) - 1;  // characters that set colors
    const int room = width - Width(line) + codes - 2;
    const std::string why = SuccessText(Printable(episode[cause].get<std::string>()), std::min(room, 60));
    if (!why.empty() && Width(why) <= room) line += "  " + why;
  }
  return line + ViolationsText(episode);
}

std::string InvalidText(int invalid, const std::string& folder) {
  if (invalid == 0) return "";
  return fmt::format("{} invalid because the policy's server failed; {} runs {} again\n",
                     invalid == 1 ? "1 episode is" : fmt::format("{} episodes are", invalid),
                     SameCommand(folder), invalid == 1 ? "it" : "them");
}

std::string SameCommand(const std::filesystem::path& folder) {
  return "the same command with " + ShellWords({"--out", folder.string(), "--resume"});
}

std::string FailedEpisodesText(const std::vector<FailedEpisode>& failed, const std::string& folder, int width,
                               bool colors) {
  constexpr size_t kShown = 10;
  if (failed.empty()) return "";
  std::string text = "failures\n";
  for (size_t i = 0; i < std::min(failed.size(), kShown); ++i)
    text += FailureText(fmt::format("{:>7}", failed[i].episode), folder, failed[i], width, colors);
  if (failed.size() > kShown) text += fmt::format("         and {} more\n", failed.size() - kShown);
  return text;
}

std::string PolicyFailuresText(const std::vector<PolicyFailure>& failures, int width, bool colors) {
  if (failures.empty()) return "";
  int longest = 0;
  for (const PolicyFailure& failure : failures) longest = std::max(longest, Width(failure.policy));
  std::string text = "failures, one of each policy\n";
  for (const auto& [policy, folder, episode] : failures)
    text += FailureText(Pad(policy, -longest), folder, episode, width, colors);
  return text;
}

std::string FailuresText(const metrics::RunSummary& summary) {
  std::string text;
  for (const auto& [reason, count] : summary.failure_reasons) {
    if (reason == end_reason::kNotJudged) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, end_reason::Text(Printable(reason)));
  }
  return text;
}

std::string RepeatabilityText(const metrics::RunSummary& summary) {
  if (summary.repeatability.empty()) return "";
  const size_t starts = summary.repeatability.size();
  int fewest = summary.repeatability[0].episodes;
  std::vector<std::pair<std::string_view, metrics::PoseRepeatability>> largest;
  for (const metrics::StartRepeatability& start : summary.repeatability) {
    fewest = std::min(fewest, start.episodes);
    for (const auto& [name, value] : start.poses) {
      auto found = std::ranges::find(largest, name, [](const auto& known) { return known.first; });
      if (found == largest.end()) found = largest.insert(found, {name, {}});
      found->second.position = std::max(found->second.position, value.position);
      found->second.rotation = std::max(found->second.rotation, value.rotation);
    }
  }
  std::vector<std::string> parts;
  for (const auto& [name, value] : largest) {
    // The relative standard error of a standard deviation of n values is about 1 / sqrt(2 n - 2).
    const double error = 1 / std::sqrt(2.0 * fewest - 2);
    const double mm = value.position * 1e3, degrees = value.rotation * 180 / std::numbers::pi;
    parts.push_back(fmt::format("{} {} mm and {} degrees", Words(std::string(name)), Number(mm, mm * error),
                                Number(degrees, degrees * error)));
  }
  const std::string of =
      starts == 1 ? fmt::format("{} successes from equal starts", fewest)
                  : fmt::format("the largest of {} starts with at least {} successes each", starts, fewest);
  return fmt::format("Repeatability of the final pose (mean + 3 s as in ISO 9283; {}): {}", of,
                     fmt::join(parts, ", "));
}

std::string SummaryTable(const metrics::RunSummary& summary, int width, bool colors) {
  std::string text;
  if (summary.complete > 0) text += RateText(summary, width, colors);
  for (const std::string& note : summary.NotesWithStages()) text += fmt::format("Note: {}\n", note);
  if (summary.invalid > 0) {
    text += fmt::format("{} of {} episodes invalid: excluded from all numbers here\n", summary.invalid,
                        summary.episodes);
  }
  if (const int incomplete = summary.episodes - summary.complete - summary.invalid; incomplete > 0) {
    text += fmt::format("{} of {} episodes incomplete: excluded from all numbers here\n", incomplete,
                        summary.episodes);
  }
  if (summary.complete == 0) return text;
  if (const std::string failures = FailuresText(summary); !failures.empty())
    text += Styled("Failures: " + failures, Style::kBad, colors) + "\n";
  if (summary.judged < summary.complete)
    text += fmt::format("Not judged: {}\n", summary.complete - summary.judged);

  std::vector<std::string> names;
  for (const metrics::MetricSummary& metric : summary.metrics) names.push_back(metric.name);
  std::vector<MetricNumber> numbers, constants;
  for (const MetricNumber& main : MainMetrics(names)) {
    (IsConstant(*summary.Find(main.name)) ? constants : numbers).push_back(main);
  }
  int label_width = 25;
  for (const MetricNumber& main : numbers)
    label_width = std::max(label_width, static_cast<int>(main.label().size()));
  constexpr int kUnitWidth = 8;
  std::vector<Statistic> statistics = Statistics();
  size_t shown = 0;
  for (int used = label_width + kUnitWidth; shown < statistics.size(); ++shown) {
    used += statistics[shown].width;
    if (used > width && shown > 0) break;
  }
  const std::string omitted = OmittedFromRunText(statistics, shown, width);
  statistics.resize(shown);
  text += "\n" + std::string(static_cast<size_t>(label_width), ' ');
  for (const Statistic& statistic : statistics) text += Pad(statistic.title, statistic.width);
  text += "\n";
  std::string note;
  for (const MetricNumber& main : numbers) {
    const metrics::MetricSummary& metric = *summary.Find(main.name);
    const auto number = [&](double value) {
      return ShownValue(*main.metric, value, metric.std / std::sqrt(metric.episodes));
    };
    const bool is_of_fewer = IsOfSuccessesOnly(main.name) && metric.episodes < summary.complete;
    text += Pad(main.label() + (is_of_fewer ? " *" : ""), -label_width);
    for (const Statistic& statistic : statistics)
      text += Pad(statistic.text(metric, number), statistic.width);
    text += main.shown_unit().empty() ? "\n" : fmt::format("  {}\n", main.shown_unit());
    if (is_of_fewer) {
      note = fmt::format("* over the {} that succeeded; everything else over all {}\n",
                         Plural(metric.episodes, "episode"), summary.complete);
    }
  }
  text += ConstantsText(constants, summary, width);
  if (const std::string repeatability = RepeatabilityText(summary); !repeatability.empty())
    text += Wrapped(repeatability, 2, static_cast<size_t>(width)) + "\n";
  return text + note + omitted;
}

}  // namespace evalbus::results
