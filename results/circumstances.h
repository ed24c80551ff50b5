// Determines which randomized start parameters influence success (docs/why.md). Each parameter of each run is
// tested by permutations (metrics/statistics/range_scan.h). p-values are adjusted with Holm's method for all
// parameters of all runs.
#pragma once

#include <string>
#include <vector>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/range_scan.h"
#include "results/run_reader.h"

namespace evalbus::results {

// Key in run.json. Its value maps a parameter's name to the list from which the parameter is chosen.
inline constexpr char kParameterChoices[] = "parameter_choices";

// Display name and unit of a parameter, derived from the end of its name.
struct ParameterName {
  // Display name, for example "pot y" for "pot_y_m" or "table texture" for "table_texture_choice".
  std::string label;
  // Display unit: "m", "degrees" or empty.
  std::string unit;
  // Factor that converts a value to `unit`.
  double scale = 1;
};
ParameterName NameOfParameter(const std::string& name);

// Episodes whose parameter is within [from, to].
struct CircumstanceBin {
  double from = 0, to = 0;
  metrics::RateBin episodes;
  // Name of the choice if the parameter is an index into a list of choices; otherwise empty.
  std::string choice{};
  // True if the bin is one of the choices with low success rates (metrics::FindLowGroup).
  bool is_low = false;

  double rate() const { return static_cast<double>(episodes.successes) / episodes.trials; }
  metrics::Interval wilson() const;
};

struct Circumstance {
  // Name as in EPISODE_BEGIN, or NAME_present: 1 if the episode has the parameters of this distractor.
  std::string name;
  metrics::RateBin episodes;
  double p = 1, p_holm = 1;
  // True if the parameter is an index into a list of choices. Such values have no order.
  bool is_choice = false;
  // from, to: the range of values that separates successes from failures best; infinite if it is open at that
  // end. Not set for choices. inside: episodes in this range; for choices, episodes of the bins that are low.
  double from = 0, to = 0;
  metrics::RateBin inside;
  // Bins for display, ascending. A choice parameter has one bin for each choice that occurred.
  std::vector<CircumstanceBin> bins;

  bool is_shown() const { return p_holm < metrics::kAlpha; }
  double inside_rate() const { return static_cast<double>(inside.successes) / inside.trials; }
  double outside_rate() const {
    return static_cast<double>(episodes.successes - inside.successes) / (episodes.trials - inside.trials);
  }
};

struct RunCircumstances {
  std::string run, policy, task;
  // Successes among the complete and judged episodes.
  metrics::RateBin episodes;
  // Tested parameters, in the order of EPISODE_BEGIN.
  std::vector<Circumstance> parameters;
  // Number of tested parameters in all runs. p_holm is adjusted for this number.
  int tested = 0;
};

// Returns one entry per run, in the order of `runs`. Parameters that are equal in all episodes are not
// tested.
std::vector<RunCircumstances> FindCircumstances(const std::vector<const RecordedRun*>& runs);

}  // namespace evalbus::results
