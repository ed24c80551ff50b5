#include "report/page/report_numbers.h"

#include <cmath>
#include <limits>

namespace evalbus::report {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

double ValueOf(const ReportEpisode& episode, const std::string& metric) {
  for (const auto& [name, value] : episode.values) {
    if (name == metric) return value;
  }
  return kNaN;
}

double FirstOf(const ReportEpisode& episode, std::initializer_list<const char*> metrics) {
  for (const char* metric : metrics) {
    if (const double value = ValueOf(episode, metric); std::isfinite(value)) return value;
  }
  return kNaN;
}

const ReportMetric* FindIn(const ReportRun& run, const std::string& metric) {
  for (const ReportMetric& candidate : run.metrics) {
    if (candidate.name == metric) return &candidate;
  }
  return nullptr;
}

double Statistic(const ReportMetric* metric, const std::string& name) {
  if (!metric) return kNaN;
  for (const ReportStatistic& statistic : metric->statistics) {
    if (statistic.name == name && !statistic.value.empty()) return statistic.value[0];
  }
  return kNaN;
}

double SuccessRate(const ReportRun& run) {
  const int judged = run.complete - run.not_judged;
  return judged > 0 ? static_cast<double>(run.successes) / judged : kNaN;
}

ReportInterval FirstInterval(const ReportRun& run) {
  return run.intervals.empty() ? ReportInterval{"", 0, 1} : run.intervals[0];
}

const char* Outcome(const ReportEpisode& episode) {
  return !episode.complete ? "incomplete" : episode.success ? "good" : "bad";
}

}  // namespace evalbus::report
