// Simulates how often `evalbus why` names a start parameter that has no effect, and how often it finds one
// that has an effect. Three parameters are drawn uniformly. docs/why.md has the results. Fails if false
// alarms are significantly more frequent than 5 %, or if an effect is found less often than stated.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/random.h"
#include "metrics/statistics/holm.h"
#include "metrics/statistics/range_scan.h"

namespace evalbus {
namespace {

constexpr int kAxes = 3;
// Success rates without and with the effect.
constexpr double kHigh = 0.85, kLow = 0.38;

struct Effect {
  const char* name;
  // Success rate for a value of the first parameter from 0 to 1.
  double (*rate)(double value);
  // True if the rate depends on the value.
  bool is_real;
  int episodes;
  // Least share of simulations in which the parameter must be named.
  double wanted;
  // True if the first parameter is one of kChoices choices instead of a number. The choices are quarters of
  // the value's range.
  bool is_choice = false;
};
constexpr int kChoices = 4;

double None(double) { return 0.73; }
double Step(double value) { return value > 0.74 ? kLow : kHigh; }
double Quarter(double value) { return value >= 0.75 ? kLow : kHigh; }
double Slope(double value) { return kHigh + (kLow - kHigh) * value; }
double Middle(double value) { return std::abs(value - 0.5) < 0.13 ? kLow : kHigh; }
double Both(double value) { return std::abs(value - 0.5) > 0.37 ? kLow : kHigh; }

constexpr Effect kEffects[] = {{"none", None, false, 30, 0},
                               {"none", None, false, 60, 0},
                               {"none", None, false, 200, 0},
                               {"none", None, false, 1000, 0},
                               {"upper quarter", Step, true, 60, 0},
                               {"upper quarter", Step, true, 200, 0.8},
                               {"upper quarter", Step, true, 1000, 0.99},
                               {"gradual", Slope, true, 60, 0},
                               {"gradual", Slope, true, 200, 0.8},
                               {"gradual", Slope, true, 1000, 0.99},
                               {"middle quarter", Middle, true, 60, 0},
                               {"middle quarter", Middle, true, 200, 0.8},
                               {"middle quarter", Middle, true, 1000, 0.99},
                               {"both ends", Both, true, 200, 0},
                               {"both ends", Both, true, 1000, 0.99},
                               {"none, a choice", None, false, 60, 0, true},
                               {"none, a choice", None, false, 200, 0, true},
                               {"none, a choice", None, false, 1000, 0, true},
                               {"one of four choices", Quarter, true, 60, 0, true},
                               {"one of four choices", Quarter, true, 200, 0.8, true},
                               {"one of four choices", Quarter, true, 1000, 0.99, true}};

struct Counts {
  int simulations = 0, found = 0, false_alarms = 0;
};

Counts Simulate(const Effect& effect, int simulations, metrics::RangeScan* scan) {
  Counts counts{.simulations = simulations};
  const auto episodes = static_cast<size_t>(effect.episodes);
  for (int k = 0; k < simulations; ++k) {
    Random random(k, static_cast<uint32_t>(effect.episodes));
    std::array<std::vector<double>, kAxes> values;
    std::vector<int> success;
    for (size_t i = 0; i < episodes; ++i) {
      for (std::vector<double>& axis : values) axis.push_back(random.Uniform(0, 1));
      success.push_back(random.Uniform(0, 1) < effect.rate(values[0][i]) ? 1 : 0);
    }
    std::vector<double> p;
    for (std::vector<double>& axis : values) {
      const bool is_choice = effect.is_choice && p.empty();
      if (is_choice) {
        for (double& value : axis) value = std::floor(kChoices * value);
      }
      const std::vector<int> bin_of =
          metrics::RankBins(axis, is_choice ? kChoices : metrics::RangeScan::BinsFor(episodes));
      std::vector<metrics::RateBin> bins(static_cast<size_t>(std::ranges::max(bin_of)) + 1);
      for (size_t i = 0; i < episodes; ++i) {
        ++bins[static_cast<size_t>(bin_of[i])].trials;
        bins[static_cast<size_t>(bin_of[i])].successes += success[i];
      }
      p.push_back(is_choice ? metrics::RangeScan::UnorderedP(bins) : scan->P(bins));
    }
    const std::vector<double> adjusted = metrics::HolmAdjusted(p);
    const auto is_named = [&](size_t axis) { return adjusted[axis] < 0.05; };
    counts.found += effect.is_real && is_named(0);
    counts.false_alarms += (!effect.is_real && is_named(0)) || is_named(1) || is_named(2);
  }
  return counts;
}

// These functions return whether `count` of the simulations is consistent with a rate of at most, or at
// least, `rate`, within three standard errors.
bool IsAtMost(int count, int simulations, double rate) {
  return count <= simulations * rate + 3 * std::sqrt(simulations * rate * (1 - rate));
}

int Measure(int simulations) {
  metrics::RangeScan scan;
  bool is_right = true;
  fmt::print("{:<16} {:>8}  {:>7}  {:>12}\n", "effect", "episodes", "found", "false alarms");
  for (const Effect& effect : kEffects) {
    const Counts counts = Simulate(effect, simulations, &scan);
    const auto share = [&](int count) { return fmt::format("{:.1f} %", 100.0 * count / simulations); };
    const bool is_quiet = IsAtMost(counts.false_alarms, simulations, 0.05);
    const bool is_found =
        IsAtMost(simulations - counts.found, simulations, 1 - effect.wanted) || !effect.is_real;
    is_right = is_right && is_quiet && is_found;
    fmt::print("{:<16} {:>8}  {:>7}  {:>12}{}\n", effect.name, effect.episodes,
               effect.is_real ? share(counts.found) : "-", share(counts.false_alarms),
               is_quiet && is_found ? "" : "  WRONG");
    std::fflush(stdout);
  }
  return is_right ? 0 : 1;
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  int simulations = 10'000;
  if (argc == 3 && std::string(argv[1]) == "--simulations") {
    const std::string text = argv[2];
    std::from_chars(text.data(), text.data() + text.size(), simulations);
  } else if (argc != 1) {
    fmt::print(stderr, "usage: why_bench [--simulations N]\n");
    return 1;
  }
  return evalbus::Measure(simulations);
}
