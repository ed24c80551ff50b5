#include "plans/latency.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/write_whole.h"
#include "plans/plan_run.h"
#include "policy_bridge/remote/latency.h"
#include "report/latency_figure.h"
#include "results/run_reader.h"
#include "runner/suite.h"

namespace evalbus::plans {

Plan LatencyPlan(const runner::RunOptions& options, const std::vector<std::string>& delays_ms,
                 const std::vector<std::string>& executions, bool rate_is_given) {
  Plan plan;
  plan.name = "latency";
  plan.options = options;
  plan.options.tasks.clear();
  // The number of workers may change when the plan is resumed.
  plan.options.workers = 1;
  plan.options.resume = false;
  plan.rate_is_given = rate_is_given;
  plan.tasks = runner::ExpandTasks(options.tasks);
  if (plan.tasks.size() != 1) throw InputError("latency: expected one task with one variation");
  std::set<std::string> names;
  for (const std::string& execution : executions) {
    for (const std::string& delay : delays_ms) {
      const policy::Latency latency = policy::ParseDelay(delay, "--delays", "milliseconds (0 to 60000)");
      const std::string name = fmt::format("{}-{:g}ms", execution, latency.fixed_s * 1e3);
      if (!names.insert(name).second)
        throw InputError("--delays, --execution: '" + name + "' occurs twice; remove one");
      plan.policies.push_back({name, options.policy.policy, options.policy.contract, delay, execution});
    }
  }
  plan.baseline = plan.policies.at(0).name;
  return OnEngine(std::move(plan), "");
}

LatencyResults RunLatencyPlan(const PlanFolder& folder, int workers) {
  RunAllEpisodes(folder, workers);
  const Plan& plan = folder.plan();
  std::vector<results::DelayPoint> points;
  std::vector<results::RecordedRun> runs;
  for (const PlannedPolicy& policy : plan.policies) {
    runs.push_back(results::ReadRun(folder.run_folder(policy.name, plan.tasks[0])));
    points.push_back(results::ReadDelayPoint(runs.back()));
  }
  const std::string title =
      fmt::format("{} on {}: {} episodes per point, seed {}, 95 % intervals", plan.policies[0].policy,
                  plan.tasks[0], plan.options.episodes, plan.options.seed);
  const nlohmann::ordered_json json = {{"policy", plan.policies[0].policy},
                                       {"task", plan.tasks[0]},
                                       {"seed", plan.options.seed},
                                       {"points", results::DelayJson(points)}};
  WriteWhole(folder.path() / "latency.json", ToText(json, 2) + "\n");
  WriteWhole(folder.path() / "latency.csv", results::DelayCsv(points));
  WriteWhole(folder.path() / "latency.svg", report::LatencyFigure(title, points));
  std::vector<results::DelayEffect> effects = results::CompareDelays(points, runs);
  return {std::move(points), std::move(effects)};
}

}  // namespace evalbus::plans
