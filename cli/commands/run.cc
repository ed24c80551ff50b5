// Implements `evalbus run`, which evaluates a policy on tasks, or runs a plan.
#include "runner/run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/help.h"
#include "base/json_file.h"
#include "base/reserved_stdout.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "plans/part.h"
#include "plans/plan_check.h"
#include "plans/plan_run.h"
#include "plans/slurm.h"
#include "results/run_reader.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

// Group in --help for options that only plans have.
constexpr char kPlanGroup[] = "Plans";

struct PlanOptions {
  // Part to run, as "K/N"; empty: the whole plan.
  std::string part;
  plans::SlurmOptions slurm;
};

// Returns true for a plan's file, and for plan.json in the folder of a plan that has begun.
bool IsPlan(const std::vector<std::string>& tasks) {
  return tasks.size() == 1 && (plans::IsPlanFile(tasks[0]) || fs::path(tasks[0]).filename() == kPlanJson);
}

// Throws InputError if the command line has an option that has no effect on a plan, because the plan sets it.
void CheckOptionsWithPlan(const CLI::App& app) {
  constexpr const char* kWithPlan[] = {"--out",        "--resume", "--workers",  "--json",
                                       "--partial-hz", "--quiet",  "--log-level"};
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    const bool is_allowed = option->get_positional() || option->get_group() == kPlanGroup ||
                            std::ranges::find(kWithPlan, option->get_name()) != std::end(kWithPlan);
    if (option->count() > 0 && !is_allowed) names.push_back(option->get_name());
  }
  if (names.empty()) return;
  if (names == std::vector<std::string>{"--in-process"}) {
    throw InputError(
        "--in-process: not needed with a plan, which evaluates each episode in one process unless its file "
        "has the option 'engine'");
  }
  throw InputError(fmt::format(
      "{}: cannot be combined with a plan, whose file has the options of its runs (docs/plans.md)",
      fmt::join(names, ", ")));
}

void AddPlanOptions(CLI::App* app, PlanOptions* options) {
  const std::string group = kPlanGroup;
  app->add_option(
         "--part", options->part,
         "K/N: evaluate only every Nth plan shard, from the Kth on; all N processes share the folder --out, "
         "in which\n'evalbus merge' combines their results")
      ->type_name("K/N")
      ->group(group);
  app->add_flag("--slurm", options->slurm.submit,
                "submit the plan to Slurm: a job array and a job that merges the results")
      ->group(group);
  app->add_flag("--slurm-dry-run", options->slurm.dry_run, "show the scripts that --slurm would submit")
      ->group(group);
  app->add_option("--partition", options->slurm.partition, "partition of the cluster; default: Slurm's")
      ->group(group);
  app->add_option("--time", options->slurm.time,
                  "time limit of an array task, in sbatch's format; default: Slurm's")
      ->group(group);
  app->add_option("--array-size", options->slurm.array_size,
                  "number of array tasks; default: chosen so that each task takes about ten minutes")
      ->check(CLI::Range(1, 100'000))
      ->group(group);
}

// Reads the options of a run, or of the runs of a suite; returns the tasks.
std::vector<std::string> TakeOptionsOf(const fs::path& folder, runner::RunOptions* options) {
  std::vector<std::string> tasks;
  if (!fs::exists(folder)) throw InputError("--like " + folder.string() + ": no such run folder");
  const auto take = [&](const fs::path& run) {
    const fs::path file = run / kRunJson;
    const std::vector<std::string> newer =
        runner::ReadOlderOptions(ReadJsonFile(file), file.string(), options);
    if (!newer.empty()) {
      fmt::print("{}: made by an older version without these options, which get their default values: {}\n",
                 Printable(file.string()), fmt::join(newer, ", "));
    }
    if (options->watch) {
      throw InputError("--like " + run.string() +
                       ": a run of 'evalbus watch', whose robot was moved by a source, not by a policy");
    }
    tasks.push_back(options->sim.task);
  };
  if (fs::exists(folder / kPlanJson)) {
    throw InputError("--like " + folder.string() + ": a plan; 'evalbus run " + (folder / kPlanJson).string() +
                     "' runs its missing episodes");
  }
  if (fs::exists(folder / kSuiteJson)) {
    for (const std::string& run : results::RunsInSuite(folder)) take(folder / run);
  } else {
    take(folder);
  }
  // Options that describe where and how the run was executed are not copied.
  options->url.clear();
  options->workers = 1;
  options->by_hand = false;
  options->until.clear();
  // The contract may have changed since then.
  options->policy.contract_sha256.clear();
  return tasks;
}

void RunPlanOrPart(const runner::RunOptions& options, const PlanOptions& plan_options,
                   const runner::RunOutput& output) {
  const fs::path file = options.tasks[0];
  const bool is_begun = file.filename() == kPlanJson;
  if (is_begun && !options.out.empty())
    throw InputError("--out: " + file.string() + " already determines the folder");
  const bool is_shared = !plan_options.part.empty() || plan_options.slurm.submit;
  const bool has_slurm = plan_options.slurm.submit || plan_options.slurm.dry_run;
  if (!plan_options.part.empty() && has_slurm)
    throw InputError("--part cannot be combined with --slurm or --slurm-dry-run, which submit all parts");
  if (!has_slurm && (!plan_options.slurm.partition.empty() || !plan_options.slurm.time.empty() ||
                     plan_options.slurm.array_size > 0)) {
    throw InputError("--partition, --time and --array-size require --slurm or --slurm-dry-run");
  }
  if (output.json && (is_shared || plan_options.slurm.dry_run))
    throw InputError("--json cannot be combined with --part, --slurm or --slurm-dry-run");
  if (is_shared && !is_begun && options.out.empty()) {
    throw InputError("--part and --slurm require --out, the folder that all parts share");
  }
  const std::optional<plans::PlanFolder> begun =
      is_begun ? std::optional<plans::PlanFolder>(file.parent_path()) : std::nullopt;
  const plans::Plan plan = begun ? begun->plan() : plans::ReadPlan(file);
  if ((is_shared || plan_options.slurm.dry_run) && plan.until)
    throw InputError(
        "--part, --slurm, --slurm-dry-run: a plan with 'until' must test all results during the run: "
        "run it on one machine");
  const auto in_folder = [&](const auto& work) {
    // A part of a plan that has begun, such as a Slurm task, belongs to a plan that was checked.
    if (!is_begun || plan_options.part.empty()) {
      plans::CheckScenes(plan);
      const std::vector<std::string> notes = output.quiet ? std::vector<std::string>() : plans::NotesOf(plan);
      for (const std::string& note : notes) fmt::print(stderr, "note: {}\n", note);
    }
    begun ? work(*begun) : work(plans::PlanFolder(plan, options.out, !plan_options.slurm.dry_run));
  };
  plans::SlurmOptions slurm = plan_options.slurm;
  slurm.cpus = options.workers;
  if (!plan_options.part.empty()) {
    int part = 0, parts = 0, end = 0;
    if (std::sscanf(plan_options.part.c_str(), "%9d/%9d%n", &part, &parts, &end) != 2 ||
        end != static_cast<int>(plan_options.part.size()) || part < 1 || part > parts) {
      throw InputError("--part " + plan_options.part + ": expected K/N, for example 3/16");
    }
    in_folder([&](const plans::PlanFolder& folder) { plans::RunPart(folder, part, parts, options.workers); });
  } else if (slurm.submit || slurm.dry_run) {
    in_folder([&](const plans::PlanFolder& folder) { plans::RunOnSlurm(folder, slurm); });
  } else {
    if (!is_begun && !options.resume && !options.out.empty()) plans::CheckOutIsNew(options.out);
    if (!is_begun && options.resume && options.out.empty())
      throw InputError("--resume requires --out: the folder of the plan to continue");
    if (!is_begun && options.resume && !output.quiet && !fs::exists(fs::path(options.out) / kPlanJson)) {
      fmt::print(output.json ? stderr : stdout, "{} has no run to resume: starting a new one\n",
                 Printable(options.out));
    }
    in_folder([&](const plans::PlanFolder& folder) { plans::RunPlan(folder, options.workers, output); });
  }
}

}  // namespace

Action AddRun(CLI::App* app) {
  const auto options = std::make_shared<runner::RunOptions>();
  const auto plan = std::make_shared<PlanOptions>();
  const auto like = std::make_shared<std::vector<std::string>>();
  const auto output = std::make_shared<runner::RunOutput>();
  // --like is added first, so that it is processed before other options, which take precedence.
  app->add_option_function<std::string>(
         "--like",
         [options, like](const std::string& folder) { *like = TakeOptionsOf(folder, options.get()); },
         "run folder or suite to take the options from, and the tasks if none is given; options on the "
         "command\nline take precedence")
      ->type_name("FOLDER");
  app->add_option(
      "task", options->tasks,
      "TASK[/VARIATION] or RoboEval's name: lift_pot/position, LiftPotPosition. Several tasks, TASK/all "
      "or\nall make a suite: a folder of runs with one summary. Without VARIATION, the task's first one is "
      "run;\nfor built-in tasks this is base, which randomizes nothing, so a policy such as expert repeats "
      "one\nepisode. Or a plan: a YAML file of policies and tasks (docs/plans.md)");
  evalbus::AddOptions(app, options.get());
  // This option is hidden, because only a run passes it to the processes that it starts.
  app->get_option("--options")->group("");
  app->add_option("--out", options->out, "run folder; default runs/TASK-VARIATION-POLICY-DATE-TIME")
      ->type_name("FOLDER");
  app->add_flag("--resume", options->resume, "continue the interrupted run in --out");
  app->add_flag("--web", options->web,
                "show the run in a browser ('evalbus web'); the page stays available until Ctrl-C");
  app->add_flag("--json", output->json,
                "print the events of the run, suite or plan as JSON, one per line, for programs; readable "
                "text goes to\nstandard error, and the run ends when the reader of standard output exits");
  app->add_option("--partial-hz", output->partial_hz,
                  "with --json: also print the score so far, this many times per simulated second; the "
                  "control rate\nprints every tick; default: only finished episodes")
      ->check(InRange(0.001, 1000.0));
  app->add_flag("--quiet", output->quiet,
                "print only errors and the number of invalid episodes; with --json, also the events");
  AddLogLevel(app);
  AddPlanOptions(app, plan.get());
  // This option is hidden, because it is only for worker processes.
  app->add_option("--worker", options->worker)->check(CLI::NonNegativeNumber)->group("");
  GroupOptions(
      app,
      {{"Policy",
        {"--policy", "--contract", "--policy-name", "--latency", "--execution", "--policy-timeout-s"}},
       {"Episodes", {"--episodes", "--only", "--seed", "--seed-stream", "--workers", "--like", "--resume"}},
       {"Simulation",
        {"--robot", "--model-path", "--assets", "--engine", "--control-hz", "--realtime", "--rtf",
         "--after-success-s", "--limits"}},
       {"Output",
        {"--out", "--video", "--gl", "--web", "--json", "--partial-hz", "--quiet", "--log", "--log-level"}},
       {"Bus and processes", {"--url", "--in-process", "--by-hand"}}});
  return [options, plan, like, output, app] {
    if (options->tasks.empty()) options->tasks = *like;
    // A new number of episodes replaces the selection of the old run.
    if (!like->empty() && app->count("--episodes") > 0 && app->count("--only") == 0) options->only.clear();
    // The old run's name belongs to its policy.
    if (!like->empty() && app->count("--policy") > 0 && app->count("--policy-name") == 0)
      options->policy_name.clear();
    // Its contract also belongs to its policy, but a server at a different address may run the same policy.
    if (!like->empty() && app->count("--policy") > 0 && app->count("--contract") == 0 &&
        options->policy.policy.find("://") == std::string::npos) {
      options->policy.contract.clear();
    }
    if (output->partial_hz > 0 && !output->json) throw InputError("--partial-hz requires --json");
    if (options->worker >= 0) {
      runner::RunWorker(*options);
    } else if (IsPlan(options->tasks)) {
      CheckOptionsWithPlan(*app);
      std::optional<ReservedStdout> no_text;
      if (output->quiet && !output->json) no_text.emplace(true);
      RunPlanOrPart(*options, *plan, *output);
    } else if (!plan->part.empty() || plan->slurm != plans::SlurmOptions()) {
      throw InputError(
          "--part and the options of Slurm: expected a plan ('evalbus run plan.yaml', docs/plans.md)");
    } else {
      runner::FollowContract(app->count("--control-hz") > 0 || !like->empty(),
                             app->count("--policy-timeout-s") > 0 || !like->empty(), options.get());
      if (options->tasks.empty()) throw InputError("run: expected a task ('evalbus tasks list' lists them)");
      for (const std::string& task : options->tasks) {
        if (IsPlan({task}))
          throw InputError(task + ": a plan cannot be combined with other tasks; its file lists its tasks");
      }
      runner::Run(*options, *output);
    }
    return 0;
  };
}

}  // namespace evalbus::commands
