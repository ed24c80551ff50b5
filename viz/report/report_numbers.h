// Numbers of a report's run, found by name; NaN or null where there are none.
#pragma once

#include <initializer_list>
#include <string>

#include "viz/report/report_page.h"

namespace evalbus::viz {

double ValueOf(const ReportEpisode& episode, const std::string& metric);
// The first of these metrics that the episode has; one- and two-armed robots have different names.
double FirstOf(const ReportEpisode& episode, std::initializer_list<const char*> metrics);

const ReportMetric* FindIn(const ReportRun& run, const std::string& metric);
double Statistic(const ReportMetric* metric, const std::string& name);

double SuccessRate(const ReportRun& run);
// The one that is drawn; of a run without any, from 0 to 1.
ReportInterval FirstInterval(const ReportRun& run);

// What became of an episode, as CSS class: "good", "bad" or "incomplete".
const char* Outcome(const ReportEpisode& episode);

}  // namespace evalbus::viz
