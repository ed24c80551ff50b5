// Looks up numbers of a run's report by name; NaN or null if missing.
#pragma once

#include <initializer_list>
#include <string>

#include "report/page/report_page.h"

namespace evalbus::report {

double ValueOf(const ReportEpisode& episode, const std::string& metric);
// Returns the first of these metrics that the episode has. Robots with one arm and with two arms have
// different metric names.
double FirstOf(const ReportEpisode& episode, std::initializer_list<const char*> metrics);

const ReportMetric* FindIn(const ReportRun& run, const std::string& metric);
double Statistic(const ReportMetric* metric, const std::string& name);

double SuccessRate(const ReportRun& run);
// The interval that figures show; 0 to 1 if the run has none.
ReportInterval FirstInterval(const ReportRun& run);

// Returns the CSS class of an episode's outcome: "good", "bad" or "incomplete".
const char* Outcome(const ReportEpisode& episode);

}  // namespace evalbus::report
