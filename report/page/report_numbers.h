// Looks up numbers of episodes by name, and derives what several sections of a run's report show.
#pragma once

#include <initializer_list>
#include <string>

#include "report/page/report_page.h"

namespace evalbus::report {

// NaN if the episode does not have the metric.
double ValueOf(const results::RecordedEpisode& episode, const std::string& metric);
// Returns the first of these metrics that the episode has. Robots with one arm and with two arms have
// different metric names.
double FirstOf(const results::RecordedEpisode& episode, std::initializer_list<const char*> metrics);

// NaN if no episode has the metric.
double MeanOf(const ReportRun& run, const std::string& metric);

// The sentence that explains how the episode ended: its cause, or the explanation in runs of older versions.
const std::string& WhyOf(const results::RecordedEpisode& episode);

// Returns the CSS class of an episode's outcome: "good", "bad" or "incomplete".
const char* Outcome(const results::RecordedEpisode& episode);

}  // namespace evalbus::report
