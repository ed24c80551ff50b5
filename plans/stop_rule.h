// Decides whether a plan stops before its maximum number of episodes (Plan::until).
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/sequential_mcnemar.h"
#include "plans/plan_folder.h"

namespace evalbus::plans {

// State of a policy's sequential comparison with the baseline.
struct Stop {
  // Number of episodes per task at this look.
  int episodes = 0;
  // Number of pairs that the policy (a) and the baseline (b) won. success: only this side succeeded.
  // progress: this side was ahead (results::SuccessCounts::ahead).
  metrics::Wins success, progress;
  // Smallest p of all looks so far. p: for all tested quantities together. success_p: for success alone.
  double p = 1, success_p = 1;
  // p and success_p, adjusted with Bonferroni's method for the number of comparisons.
  double p_adjusted = 1, success_p_adjusted = 1;
  bool is_decided = false;
  // True if the comparison of success alone is decided.
  bool is_success_decided = false;
  // True if the comparison is not decided, and the chance that it is decided by the plan's maximum is below
  // metrics::kLeastChance.
  bool is_hopeless = false;
  // Returns true if the policy runs no more episodes.
  bool has_ended(const Until& until) const {
    return is_decided || is_hopeless || episodes >= until.max_episodes;
  }

  // Returns a description of the state, for example "better than expert, decided after 40 of 200 episodes of
  // each task: ...".
  std::string Text(const std::string& baseline, const Until& until) const;
  nlohmann::ordered_json Json(const std::string& policy, const std::string& baseline,
                              const Until& until) const;
};

// Compares a policy with the baseline by their first `episodes` episodes of each task. A resumed plan may
// already have more episodes. `before`: the previous look.
Stop LookAtDifference(const PlanFolder& folder, const std::string& policy, const Stop& before, int episodes);

// State of a policy's `width` rule (Plan::until).
struct WidthStop {
  int episodes = 0;
  // Anytime-valid interval of the success rate on the task where it is widest.
  metrics::Interval widest{};
  bool is_narrow = false;
  bool has_ended(const Until& until) const { return is_narrow || episodes >= until.max_episodes; }

  // Returns a description of the state, for example "success 62.0 to 71.0 % (95 %, valid at any look) after
  // 400 of at most 2000 episodes".
  std::string Text(const Until& until) const;
  nlohmann::ordered_json Json(const std::string& policy, const Until& until) const;
};
WidthStop LookAtWidth(const PlanFolder& folder, const std::string& policy, int episodes);

// Returns the number of episodes of each task at the look that follows the look at `episodes`.
int NextLook(const Plan& plan, int episodes);

// Returns the contents of stops.json, by repeating all looks of each policy with the episodes in the folder.
nlohmann::ordered_json StopsJson(const PlanFolder& folder);

}  // namespace evalbus::plans
