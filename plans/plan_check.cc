#include "plans/plan_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "base/errors.h"
#include "base/suggestion.h"
#include "base/text.h"
#include "models/task_description.h"
#include "policy_bridge/policy_options.h"
#include "sim/prepared_scene.h"
#include "viz/images/video.h"

namespace evalbus::plans {
namespace {

// A reason why the plan cannot be run, and the tasks that it applies to.
struct Problem {
  // Location in the plan's file, and for a policy its name.
  std::string where;
  std::string reason;
  std::vector<std::string> tasks;

  std::string Text(size_t num_tasks) const {
    const std::string others = tasks.size() == 1 ? ""
                               : tasks.size() == num_tasks
                                   ? " and all other tasks"
                                   : fmt::format(" and {}", Plural(tasks.size() - 1, "other task"));
    return Printable(fmt::format("{}{}{}: {}", where, tasks[0], others, reason));
  }
};

class Problems {
 public:
  // Calls `check`, and adds the message of its InputError.
  template <class F>
  void Collect(const std::string& where, const std::string& task, const F& check) {
    try {
      check();
    } catch (const InputError& error) {
      const std::string reason = error.what();
      const auto same = std::ranges::find_if(problems_, [&](const Problem& problem) {
        return problem.where == where && problem.reason == reason;
      });
      if (same == problems_.end()) {
        problems_.push_back({where, reason, {task}});
      } else {
        same->tasks.push_back(task);
      }
    }
  }

  std::vector<std::string> Texts(size_t num_tasks) const {
    std::vector<std::string> texts;
    for (const Problem& problem : problems_) texts.push_back(problem.Text(num_tasks));
    return texts;
  }

 private:
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<std::string> ProblemsOf(const Plan& plan) {
  Problems problems;
  for (const std::string& task : plan.tasks) {
    // All policies have the same scene, because the plan requires equal control rates.
    sim::SimOptions options = plan.OptionsOf(plan.policies[0]).sim;
    options.task = task;
    problems.Collect(plan.tasks_where, task, [&] {
      const sim::PreparedScene prepared = sim::ComposeScene(options);
      problems.Collect(plan.videos.where, task,
                       [&] { viz::CheckCameras(*prepared.scene.visual, plan.videos.cameras); });
      for (const PlannedPolicy& policy : plan.policies) {
        problems.Collect(policy.where + policy.name + " on ", task, [&] {
          policy::FindPolicy(plan.OptionsOf(policy).policy)(*prepared.scene.physics, prepared.info);
        });
      }
    });
  }
  return problems.Texts(plan.tasks.size());
}

std::vector<std::string> NotesOf(const Plan& plan) {
  std::vector<std::string> notes, tasks;
  for (const TaskDescription& task : AllTasks()) tasks.push_back(task.name);
  for (const std::string& task : plan.tasks) tasks.push_back(FindTask(task).task.name);
  for (const PlannedPolicy& policy : plan.policies) {
    const auto contract = policy::FindContractOf(plan.OptionsOf(policy).policy);
    if (!contract) continue;
    const auto add = [&](const std::string& what) {
      notes.push_back(Printable(fmt::format("{}: {}: {}", policy.name, contract->file.string(), what)));
    };
    if (contract->batch_size > 1)
      add("batch_size has no effect in a plan, whose runs each have their own connection to the server");
    for (const auto& [task, prompt] : contract->prompts) {
      if (std::ranges::find(tasks, task) == tasks.end())
        add("prompts: there is no task '" + task + "'" + Suggestion(task, tasks, ""));
    }
  }
  return notes;
}

void CheckScenes(const Plan& plan) {
  const std::vector<std::string> problems = ProblemsOf(plan);
  if (problems.empty()) return;
  for (size_t i = 0; i + 1 < problems.size(); ++i) fmt::print(stderr, "error: {}\n", problems[i]);
  throw InputError(problems.back());
}

}  // namespace evalbus::plans
