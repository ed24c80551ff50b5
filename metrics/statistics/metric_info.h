// What people want to know of a metric before they read its numbers: a name, a unit, which way is better.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace evalbus::metrics {

enum class Better { kLower, kHigher, kNeither };

struct MetricInfo {
  // As in summary.json.
  std::string_view name;
  std::string_view label;
  // Shown value = value * scale, in this unit; empty: a count.
  std::string_view unit;
  double scale;
  Better better;
  // What it took to get there: says something of episodes that succeeded only, since who gives up at once has
  // the shortest path.
  bool effort;
};

// The metrics that tables show and comparisons test, in the order of the questions people ask: how long, how
// far, how clean, how smooth. Of a metric that exists per arm and for both arms together, that for both.
std::span<const MetricInfo> MainMetrics();

}  // namespace evalbus::metrics
