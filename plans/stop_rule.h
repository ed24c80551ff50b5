// When a plan stops before its largest number of episodes (Plan::until).
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrics/statistics/interval.h"
#include "metrics/statistics/sequential_mcnemar.h"
#include "plans/plan_folder.h"

namespace evalbus::plans {

// State of a policy's sequential comparison with the baseline.
struct Stop {
  // Episodes per task.
  int episodes = 0;
  // Pairs that the policy (a) and the baseline (b) won: in which only it succeeded; in which it was ahead
  // (results::SuccessCounts::ahead).
  metrics::Wins success, progress;
  // The smallest p of all looks; of the tested quantities together, and of success alone.
  double p = 1, success_p = 1;
  // The same, adjusted for the number of comparisons (Bonferroni).
  double p_adjusted = 1, success_p_adjusted = 1;
  bool is_decided = false;
  // Whether success alone is decided.
  bool is_success_decided = false;
  // Not decided, and probably not until the plan's maximum either (metrics::kLeastChance).
  bool is_hopeless = false;
  // True if the policy runs no more episodes.
  bool has_ended(const Until& until) const {
    return is_decided || is_hopeless || episodes >= until.max_episodes;
  }

  // For example "better than expert, decided after 40 of 200 episodes of each task: ...".
  std::string Text(const std::string& baseline, const Until& until) const;
  nlohmann::ordered_json Json(const std::string& policy, const std::string& baseline,
                              const Until& until) const;
};

// Compares a policy with the baseline by their first `episodes` episodes of each task, also if there are
// more, as in a plan that is resumed. `before`: the look before.
Stop LookAtDifference(const PlanFolder& folder, const std::string& policy, const Stop& before, int episodes);

// Widths of a policy's success rates: `width` rules of Plan::until.
struct WidthStop {
  int episodes = 0;
  // Anytime-valid interval of the success rate on the task where it is widest.
  metrics::Interval widest{};
  bool is_narrow = false;
  bool has_ended(const Until& until) const { return is_narrow || episodes >= until.max_episodes; }

  // For example "0.62 to 0.71 after 400 episodes".
  std::string Text(const Until& until) const;
  nlohmann::ordered_json Json(const std::string& policy, const Until& until) const;
};
WidthStop LookAtWidth(const PlanFolder& folder, const std::string& policy, int episodes);

// Number of episodes of each task at the look after `episodes`.
int NextLook(const Plan& plan, int episodes);

// Value of stops.json, from the episodes in the folder: repeats all looks of each policy.
nlohmann::ordered_json StopsJson(const PlanFolder& folder);

}  // namespace evalbus::plans
