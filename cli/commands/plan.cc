// Implements `evalbus plan`, `merge` and `status`, which inspect, merge and monitor plans of many runs, on
// one machine or a cluster.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/errors.h"
#include "base/text.h"
#include "cli/commands/commands.h"
#include "metrics/statistics/power.h"
#include "plans/merge.h"
#include "plans/plan_check.h"
#include "plans/plan_run.h"
#include "plans/probe.h"
#include "plans/status.h"
#include "report/viewer_pack.h"
#include "results/summary_table.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using plans::Plan;

std::string Size(double bytes) {
  const char* const units[] = {"B", "kB", "MB", "GB", "TB"};
  int unit = 0;
  for (; bytes >= 1000 && unit < 4; ++unit) bytes /= 1000;
  return fmt::format("{:.3g} {}", bytes, units[unit]);
}

// Returns the smallest true difference between success rates over this number of tasks that the plan's test
// detects with 80 % power, as text; "none" if no difference is detected with this power.
std::string FindableText(const Plan& plan, int tasks) {
  const double alpha =
      (plan.until ? plan.until->alpha : metrics::kAlpha) / static_cast<double>(plan.policies.size() - 1);
  const auto findable = metrics::FindableDifference([&](double difference) {
    const auto shares = metrics::DiscordantShares::AroundOneHalf(difference);
    return plan.until ? metrics::SequentialPower(plan.options.episodes * tasks,
                                                 plan.until->max_episodes * tasks, shares, alpha)
                      : metrics::McNemarPower(plan.options.episodes * tasks, shares, alpha);
  });
  return findable ? fmt::format("{:.0f} points", std::ceil(100 * *findable)) : "none";
}

std::string PowerText(const Plan& plan) {
  const auto tasks = static_cast<int>(plan.tasks.size());
  return fmt::format(
      "power     true difference that is detected with 80 % power: {}{}\n"
      "          ({}, rates around 50 %; equal seeds usually add power)\n",
      FindableText(plan, tasks),
      tasks > 1 ? fmt::format(" over all tasks, {} on one", FindableText(plan, 1)) : "",
      plan.until
          ? fmt::format("sequential test, at most {} episodes of each task", plan.until->max_episodes)
          : fmt::format("exact McNemar test, {} of each task", Plural(plan.options.episodes, "episode")));
}

// Prints the plan; returns false if it cannot be run.
bool Show(const Plan& plan, bool probe) {
  const int runs = plan.num_runs(), episodes = plan.options.episodes;
  const auto tasks = static_cast<int>(plan.tasks.size());
  fmt::print("plan      {}\n", plan.name);
  for (size_t i = 0; i < plan.policies.size(); ++i) {
    const plans::PlannedPolicy& policy = plan.policies[i];
    fmt::print("{}  {}{}{}\n", i == 0 ? "policies" : "        ", policy.name,
               policy.name == policy.policy ? "" : "  (" + policy.policy + ")",
               policy.name == plan.baseline && plan.policies.size() > 1 ? "  baseline" : "");
  }
  for (int i = 0; i < tasks; ++i) {
    fmt::print("{}  {}\n", i == 0 ? "tasks   " : "        ", plan.tasks[static_cast<size_t>(i)]);
  }
  const int64_t all = int64_t{runs} * episodes;
  // With `until`, these episodes are run before the first test.
  const char* const least = plan.until ? "at least " : "";
  fmt::print("episodes  {} of each policy and task, seed {}: {}, {}{}\n", episodes, plan.options.seed,
             Plural(runs, "run"), least, Plural(all, "episode"));
  fmt::print("videos    {}\n", plans::VideosText(plan.videos));
  const bool has_width = plan.until && plan.until->width;
  if (has_width) {
    fmt::print(
        "until     the 95 % interval of each success rate is at most {:g} points wide, at most {} episodes\n",
        100 * *plan.until->width, plan.until->max_episodes);
  } else if (plan.until) {
    fmt::print(
        "until     each comparison is decided{} (alpha {:g} in total), with a test after every {} episodes "
        "of each task, at most {}\n",
        plan.until->on_progress ? " by success or progress" : "", plan.until->alpha, episodes,
        plan.until->max_episodes);
  }
  if (plan.policies.size() > 1 && !has_width) fmt::print("{}", PowerText(plan));
  const std::vector<std::string> problems = plans::ProblemsOf(plan);
  for (const std::string& problem : problems) fmt::print("problem   {}\n", problem);
  for (const std::string& note : plans::NotesOf(plan)) fmt::print("note      {}\n", note);
  // Episodes of such a plan are not tried: they would fail for the same reasons.
  if (!probe || !problems.empty()) return problems.empty();
  constexpr int kProbes = 6;
  const plans::Probe found = plans::ProbePlan(plan, kProbes);
  if (found.episodes > 0) {
    const double logs = found.bytes_per_episode * static_cast<double>(all);
    const double others = found.bytes_per_run * runs;
    // The plan and each policy have a report, and each policy except the baseline has a comparison.
    const size_t pages = 2 * plan.policies.size();
    fmt::print(
        "time      {}{} on one core, without videos and pages ({:.2g} s per episode, measured with {})\n"
        "disk      {}{}: logs {} ({} per episode), other files {} ({} per run); also {} of at most {:g} MB "
        "each\n",
        least, results::FormatDuration(found.seconds_per_episode * static_cast<double>(all)),
        found.seconds_per_episode, found.episodes, least, Size(logs + others), Size(logs),
        Size(found.bytes_per_episode), Size(others), Size(found.bytes_per_run), Plural(pages, "page"),
        report::kPageMegabytes);
  }
  if (!found.problem.empty()) fmt::print("problem   {}\n", Printable(found.problem));
  return found.problem.empty();
}

int Merge(const fs::path& folder, const std::vector<fs::path>& parts) {
  if (!parts.empty()) {
    if (fs::exists(folder)) throw InputError(folder.string() + ": exists; choose another name");
    plans::MergeRuns(parts, fs::absolute(folder));
    fmt::print("{}\n", folder.string());
    return 0;
  }
  const plans::PlanFolder plan(folder);
  const std::vector<plans::Shard> missing = plans::MergePlan(plan);
  if (!missing.empty()) {
    throw EnvironmentError(
        fmt::format("{}: {} of {} shards are missing, the first is {}; all complete runs were merged",
                    folder.string(), missing.size(), plans::ShardsOf(plan.plan()).size(), missing[0].name()));
  }
  plans::FinishPlan(plan, 1);
  return 0;
}

}  // namespace

Action AddPlan(CLI::App* app) {
  struct Options {
    fs::path file;
    bool no_probe = false;
  };
  const auto options = std::make_shared<Options>();
  app->require_subcommand(1);
  CLI::App* const show = app->add_subcommand(
      "show", "show the runs, episodes, time, disk space and statistical power of a plan");
  show->add_option("plan", options->file, "YAML file (docs/plans.md)")->required();
  show->add_flag("--no-probe", options->no_probe, "do not run episodes to estimate time and disk space");
  CLI::App* const check = app->add_subcommand("check", "check whether a plan can be run");
  check->add_option("plan", options->file, "YAML file")->required();
  return [options, check] {
    const Plan plan = plans::ReadPlan(options->file);
    if (check->parsed()) {
      plans::CheckScenes(plan);
      for (const std::string& note : plans::NotesOf(plan)) fmt::print("note: {}\n", note);
      fmt::print("{}: {} of {}\n", options->file.string(), Plural(plan.num_runs(), "run"),
                 plan.until
                     ? fmt::format("{} to {} episodes", plan.options.episodes, plan.until->max_episodes)
                     : Plural(plan.options.episodes, "episode"));
      return 0;
    }
    return Show(plan, !options->no_probe) ? 0 : 1;
  };
}

Action AddMerge(CLI::App* app) {
  struct Options {
    fs::path folder;
    std::vector<fs::path> parts;
  };
  const auto options = std::make_shared<Options>();
  app->add_option("folder", options->folder, "folder of a plan; if RUN is given: run folder to write")
      ->required();
  app->add_option("run", options->parts,
                  "run folders, each with some of the episodes, that were written with --only");
  return [options] { return Merge(options->folder, options->parts); };
}

Action AddStatus(CLI::App* app) {
  const auto folder = std::make_shared<fs::path>();
  app->add_option("folder", *folder, "folder of a plan; works on any machine that can read it")->required();
  return [folder] {
    fmt::print("{}", plans::StatusOf(plans::PlanFolder(*folder)).Text());
    return 0;
  };
}

}  // namespace evalbus::commands
