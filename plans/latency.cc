#include "plans/latency.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options.h"
#include "base/write_whole.h"
#include "lcmtypes/clock.h"
#include "plans/plan_run.h"
#include "policy_bridge/policy_options.h"
#include "policy_bridge/remote/latency.h"
#include "report/latency_figure.h"
#include "results/run_reader.h"
#include "runner/suite.h"
#include "sim/prepared_scene.h"

namespace evalbus::plans {
namespace {

// Selects the delays that differ in ticks, and prints a note on the delays that are rounded or left out.
class RoundedDelays {
 public:
  explicit RoundedDelays(double control_hz) : tick_s_(1 / control_hz) {}
  // Returns false if the delay has the same number of ticks as an earlier one.
  bool Add(double delay_s) {
    const std::string name = fmt::format("{:g}", delay_s * 1e3);
    const int64_t ticks = policy::HeldTicks(delay_s, tick_s_);
    const double applied_s = static_cast<double>(ticks) * tick_s_;
    const std::string rounded = fmt::format("{} ms to {:.4g} ms", name, applied_s * 1e3);
    const bool is_new = ticks_.insert(ticks).second;
    if (!is_new) {
      notes_.push_back(rounded + " (left out: an earlier delay has the same number of ticks)");
    } else if (applied_s - delay_s > 1e-6) {
      notes_.push_back(rounded);
    }
    return is_new;
  }
  void PrintNote() const {
    if (notes_.empty()) return;
    fmt::print(stderr, "note: delays are rounded up to ticks of {:.4g} ms: {}\n", tick_s_ * 1e3,
               fmt::join(notes_, ", "));
  }

 private:
  double tick_s_;
  std::set<int64_t> ticks_;
  std::vector<std::string> notes_;
};

// Returns the control rate of the plan's runs, which is rounded to whole physics steps.
double RealRate(const Plan& plan) {
  const runner::RunOptions& given = plan.options;
  CheckRanges(given);
  sim::SimOptions options =
      plan.OptionsOf({.name = "", .policy = given.policy.policy, .contract = given.policy.contract}).sim;
  options.task = plan.tasks[0];
  return RealControlHz(options.control_hz, sim::ComposeScene(options).info.timestep_us);
}

}  // namespace

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
  const double control_hz = RealRate(plan);
  std::set<std::string> names;
  // A scripted policy continues its plan from one chunk to the next, so its chunks need not be joined.
  const bool is_scripted =
      options.policy.policy != policy::kExternalPolicy && !policy::FindContractOf(options.policy);
  const bool has_asynchronous = std::ranges::find(executions, "asynchronous") != executions.end();
  bool is_first = true;
  for (const std::string& execution : executions) {
    if (execution == "rtc" && is_scripted && has_asynchronous) {
      fmt::print(stderr,
                 "note: rtc is left out, because a scripted policy's results equal those of asynchronous\n");
      continue;
    }
    RoundedDelays delays(control_hz);
    for (const std::string& delay : delays_ms) {
      const policy::Latency latency = policy::ParseDelay(delay, "--delays", "milliseconds (0 to 60000)");
      const std::string name = fmt::format("{}-{:g}ms", execution, latency.fixed_s * 1e3);
      if (!names.insert(name).second)
        throw InputError("--delays, --execution: '" + name + "' occurs twice; remove one");
      const PlannedPolicy policy{name, options.policy.policy, options.policy.contract, delay, execution};
      if (delays.Add(latency.fixed_s)) plan.policies.push_back(policy);
    }
    // The delays of each execution mode are rounded alike.
    if (std::exchange(is_first, false)) delays.PrintNote();
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
