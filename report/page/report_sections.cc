#include "report/page/report_sections.h"

#include <cmath>
#include <limits>

#include "lcmtypes/end_reason.h"

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

std::vector<std::pair<std::string, int>> FailureReasonsOf(const metrics::RunSummary& summary) {
  auto reasons = summary.failure_reasons;
  std::erase_if(reasons, [](const auto& entry) { return entry.first == end_reason::kNotJudged; });
  return reasons;
}

const std::string& WhyOf(const results::RecordedEpisode& episode) {
  return episode.cause.text.empty() ? episode.explanation : episode.cause.text;
}

const char* Outcome(const results::RecordedEpisode& episode) {
  return !episode.complete || !episode.judged() ? "incomplete" : episode.success ? "good" : "bad";
}

}  // namespace evalbus::report
