// Finished episodes and runs as text for a terminal.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrics/statistics/run_statistics.h"

namespace evalbus::results {

// "1:05 min", "12 s"; for people.
std::string FormatDuration(double seconds);

// "72 to 100 %"; with a decimal where it is narrower than two points.
std::string PercentText(const metrics::Interval& interval);

// A line per finished episode, from its line of episodes.jsonl, and the titles above: columns from the left
// as far as the width goes.
std::string EpisodeHeader(int width);
std::string EpisodeLine(const nlohmann::ordered_json& episode, int width);

// What to do about so many episodes of this folder that are invalid, a line; empty where there are none.
std::string InvalidText(int invalid, const std::string& folder);

// How many failed for what: "2 grasp_slip, 1 dropped".
std::string FailuresText(const metrics::RunSummary& summary);

// The table at the end: rate with its interval, then the main metrics, with units. As many columns as the
// width has room for.
std::string SummaryTable(const metrics::RunSummary& summary, int width);

}  // namespace evalbus::results
