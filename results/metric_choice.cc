#include "results/metric_choice.h"

#include "base/errors.h"
#include "base/suggestion.h"
#include "base/text.h"

namespace evalbus::results {
namespace {

// Returns the numbers whose metric or label is `name`.
std::vector<MetricNumber> Matching(const std::string& name, const std::vector<MetricNumber>& numbers) {
  std::vector<MetricNumber> found;
  for (const MetricNumber& number : numbers) {
    const MetricInfo& metric = *number.metric;
    if (name == metric.name || name == metric.wire_name() || Words(name) == metric.label ||
        Words(name) == number.label())
      found.push_back(number);
  }
  return found;
}

}  // namespace

std::vector<MetricNumber> FindNumbers(const std::string& name, const std::set<std::string>& available) {
  // Users may omit the prefix.
  for (const std::string& exact : {name, std::string(kExtended) + name}) {
    if (available.contains(exact)) return {FindMetric(exact)};
  }
  std::vector<MetricNumber> all;
  for (const std::string& each : available) {
    if (const MetricNumber number = FindMetric(each); number.metric) all.push_back(number);
  }
  // Main metrics come first: "wrist_path" then stands for the path of both arms, which tables show.
  std::vector<MetricNumber> found = Matching(name, MainMetrics({available.begin(), available.end()}));
  if (found.empty()) found = Matching(name, all);
  if (!found.empty()) return found;
  std::vector<std::string> numbers, metrics;
  for (const MetricNumber& number : all) {
    numbers.push_back(number.metric->is_extended() ? number.name.substr(kExtended.size()) : number.name);
    metrics.emplace_back(number.metric->wire_name());
  }
  throw InputError("--on " + name + ": no such metric in both runs" +
                   Suggestion(name, numbers, "; expected one of " + ListOf(metrics)));
}

}  // namespace evalbus::results
