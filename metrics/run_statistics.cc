#include "metrics/run_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace evalbus {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void Flatten(const nlohmann::ordered_json& value, const std::string& name,
             std::vector<std::pair<std::string, double>>* out) {
  if (value.is_boolean()) {
    out->emplace_back(name, value.get<bool>() ? 1 : 0);
  } else if (value.is_number()) {
    out->emplace_back(name, value.get<double>());
  } else if (value.is_object()) {
    for (const auto& [key, child] : value.items()) Flatten(child, name.empty() ? key : name + "." + key, out);
  }
}

}  // namespace

std::vector<std::pair<std::string, double>> FlattenedValues(const nlohmann::ordered_json& metrics) {
  std::vector<std::pair<std::string, double>> values;
  Flatten(metrics, "", &values);
  return values;
}

run_summary_t Summarize(const std::vector<EpisodeResult>& episodes) {
  run_summary_t summary{};
  std::vector<std::string> names;
  std::vector<std::vector<double>> samples;
  summary.num_episodes = episodes.size();
  for (const EpisodeResult& episode : episodes) {
    if (!episode.complete) continue;
    ++summary.num_complete;
    summary.num_success += episode.success;
    for (const auto& [name, value] : FlattenedValues(episode.metrics)) {
      const size_t index = std::find(names.begin(), names.end(), name) - names.begin();
      if (index == names.size()) {
        names.push_back(name);
        samples.emplace_back();
      }
      samples[index].push_back(value);
    }
  }
  summary.success_rate =
      summary.num_complete > 0 ? static_cast<double>(summary.num_success) / summary.num_complete : kNaN;
  const Interval interval = WilsonInterval(summary.num_success, summary.num_complete);
  summary.success_rate_lower = interval.lower;
  summary.success_rate_upper = interval.upper;

  summary.num_metrics = names.size();
  summary.metric_name = names;
  for (std::vector<double>& x : samples) {
    const size_t n = x.size();
    std::sort(x.begin(), x.end());
    const double mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
    double squares = 0;
    for (double value : x) squares += (value - mean) * (value - mean);
    summary.mean_mixed.push_back(mean);
    summary.std_mixed.push_back(n > 1 ? std::sqrt(squares / (n - 1)) : kNaN);
    summary.median_mixed.push_back((x[(n - 1) / 2] + x[n / 2]) / 2);
    summary.min_mixed.push_back(x.front());
    summary.max_mixed.push_back(x.back());
  }
  return summary;
}

}  // namespace evalbus
