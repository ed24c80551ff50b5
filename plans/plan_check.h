// Checks a plan against the scenes of its tasks, before an episode runs.
#pragma once

#include <string>
#include <vector>

#include "plans/plan.h"

namespace evalbus::plans {

// Returns one line for each reason why the plan cannot be run completely: a scene that cannot be composed, a
// policy that cannot act in a task, for example because the task has no expert, and a camera that a scene
// does not have. Composes the scene of each task and creates each policy, but runs no episode and connects to
// no server. A reason that applies to several tasks is one line.
std::vector<std::string> ProblemsOf(const Plan& plan);

// Returns one line for each setting of a policy's contract that has no effect in this plan: batch_size, and
// prompts for tasks that neither evalbus nor the plan has.
std::vector<std::string> NotesOf(const Plan& plan);

// Throws InputError with the last of ProblemsOf() if there are any, after printing the others as errors.
void CheckScenes(const Plan& plan);

}  // namespace evalbus::plans
