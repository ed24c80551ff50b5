#include "report/page/report_sections.h"

#include <cmath>
#include <limits>

namespace evalbus::report {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

double ValueOf(const results::RecordedEpisode& episode, const std::string& metric) {
  return episode.Find(metric).value_or(kNaN);
}

double FirstOf(const results::RecordedEpisode& episode, std::initializer_list<const char*> metrics) {
  for (const char* metric : metrics) {
    if (const double value = ValueOf(episode, metric); std::isfinite(value)) return value;
  }
  return kNaN;
}

double MeanOf(const ReportRun& run, const std::string& metric) {
  const metrics::MetricSummary* summary = run.summary.Find(metric);
  return summary ? summary->mean : kNaN;
}

const std::string& WhyOf(const results::RecordedEpisode& episode) {
  return episode.cause.text.empty() ? episode.explanation : episode.cause.text;
}

const char* Outcome(const results::RecordedEpisode& episode) {
  return !episode.complete ? "incomplete" : episode.success ? "good" : "bad";
}

}  // namespace evalbus::report
