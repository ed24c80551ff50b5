// Functions that several sections of a run's report use to look up and derive values.
#pragma once

#include <initializer_list>
#include <string>

#include "report/page/report_page.h"

namespace evalbus::report {

// Returns NaN if the episode does not have the metric.
double ValueOf(const results::RecordedEpisode& episode, const std::string& metric);
// Returns the first of these metrics that the episode has. Robots with one arm and with two arms have
// different metric names.
double FirstOf(const results::RecordedEpisode& episode, std::initializer_list<const char*> metrics);

// Returns NaN if no episode has the metric.
double MeanOf(const ReportRun& run, const std::string& metric);

// Returns the sentence that explains how the episode ended: its cause or, in runs of older versions, its
// explanation.
const std::string& WhyOf(const results::RecordedEpisode& episode);

// Returns the CSS class of an episode's outcome: "good", "bad" or "incomplete".
const char* Outcome(const results::RecordedEpisode& episode);

}  // namespace evalbus::report
