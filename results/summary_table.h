// Formats finished episodes and runs as text for a terminal.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "metrics/statistics/run_statistics.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Formats a duration, for example as "1:05 min" or "12 s".
std::string FormatDuration(double seconds);

// Formats an interval, for example as "72 to 100 %"; with one decimal if it is narrower than two percentage
// points.
std::string PercentText(const metrics::Interval& interval);

// Returns a paragraph on columns that do not fit into the terminal; empty if there are none. columns: names
// of the columns, and where their values are, for example "p5, p95 (see summary.json)".
std::string OmittedColumnsText(const std::vector<std::string>& columns, int width);

// Returns the conditions in the sentence on the cause of a success, for example "height of pot 1.097 m, tilt
// of pot 0.3 degrees"; only the first one if all have more than `most` characters. Empty if the sentence
// names none.
std::string SuccessText(const std::string& cause, int most = 60);

// EpisodeHeader() returns the column titles, and EpisodeLine() the line of a finished episode. `episode`: its
// line of episodes.jsonl. Columns that do not fit into `width` are omitted from the right. If there is room,
// the line of a success ends with SuccessText(). colors: see base/styled_text.h.
std::string EpisodeHeader(int width);
std::string EpisodeLine(const nlohmann::ordered_json& episode, int width, bool colors = false);

// Returns a line with advice on the invalid episodes in this folder; empty if there are none.
std::string InvalidText(int invalid, const std::string& folder);

// Returns "the same command with --out FOLDER --resume", which continues a run, a suite or a plan.
std::string SameCommand(const std::filesystem::path& folder);

// Returns the counts of the failure reasons, for example "2 slipped from the gripper, 1 dropped".
std::string FailuresText(const metrics::RunSummary& summary);

// Returns a sentence on the repeatability of the final poses. If it was computed for several starts, names
// the largest value. Empty if there is none.
std::string RepeatabilityText(const metrics::RunSummary& summary);

// Returns the final table: success rate with its interval, then the main metrics with units. Columns that do
// not fit into `width` are omitted. Paragraphs below the table name the metrics that are equal in every
// episode, the repeatability, and the omitted columns, including columns that EpisodeLine() omitted.
std::string SummaryTable(const metrics::RunSummary& summary, int width, bool colors = false);

// An episode without success, its failure reason and its decisive moment.
struct FailedEpisode {
  int episode;
  std::string reason;
  Cause cause;
};
// Returns, for each of the first ten failed episodes, the command that shows it and the sentence on its
// cause, wrapped at `width`. Empty if there are none. folder: folder of the run, for the commands.
std::string FailedEpisodesText(const std::vector<FailedEpisode>& failed, const std::string& folder, int width,
                               bool colors);

// A failed episode of a plan's policy. folder: folder of its run.
struct PolicyFailure {
  std::string policy, folder;
  FailedEpisode episode;
};
// Returns the same text for one failed episode of each policy.
std::string PolicyFailuresText(const std::vector<PolicyFailure>& failures, int width, bool colors);

}  // namespace evalbus::results
