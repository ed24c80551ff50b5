// Finished episodes and runs as text for a terminal.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrics/statistics/run_statistics.h"

namespace evalbus::results {

// For example "1:05 min" or "12 s".
std::string FormatDuration(double seconds);

// For example "72 to 100 %"; with one decimal if narrower than two percentage points.
std::string PercentText(const metrics::Interval& interval);

// The column titles, and a line for a finished episode from its line of episodes.jsonl. Columns that do not
// fit into `width` are omitted from the right.
std::string EpisodeHeader(int width);
std::string EpisodeLine(const nlohmann::ordered_json& episode, int width);

// Returns advice on invalid episodes in this folder, as a line; empty if there are none.
std::string InvalidText(int invalid, const std::string& folder);

// Counts of the failure reasons, for example "2 grasp_slip, 1 dropped".
std::string FailuresText(const metrics::RunSummary& summary);

// The final table: success rate with its interval, then the main metrics with units. Columns that do not fit
// into `width` are omitted.
std::string SummaryTable(const metrics::RunSummary& summary, int width);

}  // namespace evalbus::results
