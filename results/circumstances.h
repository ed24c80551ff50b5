// Which randomized start parameters influence success (docs/why.md). Each parameter of each run is tested by
// permutations (metrics/statistics/range_scan.h); p-values are adjusted by Holm for all of them together.
#pragma once

#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/range_scan.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Key in run.json of the lists from which parameters are chosen, by name.
inline constexpr char kParameterChoices[] = "parameter_choices";

// A parameter whose name ends in its unit, as it is shown.
struct ParameterName {
  // For example "pot y" of "pot_y_m", "table texture" of "table_texture_choice".
  std::string label;
  // "m", "deg" or empty.
  std::string unit;
  // Converts a value to the unit.
  double scale = 1;
};
ParameterName NameOfParameter(const std::string& name);

// Episodes whose parameter is within [from, to].
struct CircumstanceBin {
  double from = 0, to = 0;
  metrics::RateBin episodes;
  // What was chosen, if the parameter is the index of a choice from a list.
  std::string choice{};
  // Whether it belongs to the choices with lower rates (metrics::FindLowGroup).
  bool is_low = false;

  double rate() const { return static_cast<double>(episodes.successes) / episodes.trials; }
  metrics::Interval wilson() const;
};

struct Circumstance {
  // Name as in EPISODE_BEGIN, or NAME_present: 1 if the episode has the parameters of this distractor.
  std::string name;
  metrics::RateBin episodes;
  double p = 1, p_holm = 1;
  // True if the parameter is the index of a choice from a list, which has no order.
  bool is_choice = false;
  // The range of values that separates successes from failures best. Infinite at the ends of the values. Of
  // choices, the bins that are low.
  double from = 0, to = 0;
  metrics::RateBin inside;
  // For display, ascending; one for each choice that occurred.
  std::vector<CircumstanceBin> bins;

  bool is_shown() const { return p_holm < metrics::kAlpha; }
  double inside_rate() const { return static_cast<double>(inside.successes) / inside.trials; }
  double outside_rate() const {
    return static_cast<double>(episodes.successes - inside.successes) / (episodes.trials - inside.trials);
  }
};

struct RunCircumstances {
  std::string run, policy, task;
  // Complete and judged episodes.
  metrics::RateBin episodes;
  // In the order of EPISODE_BEGIN.
  std::vector<Circumstance> parameters;
  // Number of parameters in all runs, for which p_holm is adjusted.
  int tested = 0;
};

// One entry per run, in their order. Values that are equal in all episodes are not tested.
std::vector<RunCircumstances> FindCircumstances(const std::vector<const RecordedRun*>& runs);

}  // namespace evalbus::results
