// The results of a plan as pages: one over all, one for each policy, one for each comparison.
#pragma once

#include <string>

#include "cli/plans/plan_folder.h"

namespace evalbus::plans {

// Writes FOLDER/report.html from what is there; links the pages of policies (POLICY/report.html) and
// comparisons (POLICY/against_BASELINE.html), whether they are there yet or not. Throws InputError where a
// policy has no finished episode.
void WritePlanReport(const PlanFolder& folder);

// The page of a policy's comparison with the baseline.
std::filesystem::path ComparisonPageOf(const PlanFolder& folder, const std::string& policy);

}  // namespace evalbus::plans
