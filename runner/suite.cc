#include "runner/suite.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/styled_text.h"
#include "base/text.h"
#include "bus/host.h"
#include "models/robot_description.h"
#include "models/task_description.h"
#include "results/run_reader.h"
#include "results/summary_table.h"
#include "runner/json_events.h"
#include "runner/prepared_run.h"
#include "runner/web_child.h"
#include "runner/workers.h"

namespace evalbus::runner {
namespace {

// Throws InputError if the suite has different options, or runs that are no longer requested. Adding runs is
// allowed.
void CheckResumable(const std::filesystem::path& folder, const RunOptions& options,
                    const std::vector<std::string>& tasks) {
  const std::filesystem::path file = folder / kSuiteJson;
  CheckFixedOptions(file, ReadJsonFile<nlohmann::ordered_json>(file), options);
  std::set<std::string> wanted;
  for (const std::string& task : tasks) wanted.insert(FolderOfTask(task));
  for (const std::string& run : results::RunsInSuite(folder)) {
    if (wanted.contains(run)) continue;
    throw InputError("--resume: " + file.string() + ": the suite has the run " + run +
                     "; also pass its task, or start another suite");
  }
}

results::RunFolder OpenFolder(const RunOptions& options) {
  return results::RunFolder::OfSuite(options.out, "suite-" + ShortPolicyName(options), options.resume);
}

}  // namespace

std::vector<std::string> ExpandTasks(const std::vector<std::string>& names) {
  std::vector<std::string> tasks;
  std::set<std::string> seen;
  std::map<std::string, std::string> by_folder;
  const auto add = [&](const std::string& name) {
    if (!seen.insert(name).second) throw InputError("task '" + name + "' is given twice");
    const auto [other, is_new] = by_folder.emplace(FolderOfTask(name), name);
    if (!is_new) {
      throw InputError("tasks '" + other->second + "' and '" + name + "' would both be in the folder " +
                       other->first + " of the suite: rename one of the files");
    }
    tasks.push_back(name);
  };
  for (const std::string& name : names) {
    const bool is_family = name.ends_with("/all");
    if (name != "all" && !is_family) {
      const TaskSelection selection = FindTask(name);
      // A task file is identified by its path.
      add(IsTaskFile(name) ? name : selection.task.name + "/" + selection.variation);
      continue;
    }
    const auto add_family = [&](const std::string& family, const TaskDescription& task) {
      for (const Variation& variation : task.variations) add(family + "/" + variation.name);
    };
    if (is_family) {
      const std::string family = name.substr(0, name.size() - 4);
      const TaskDescription task = FindTask(family).task;
      add_family(IsTaskFile(family) ? family : task.name, task);
    } else {
      for (const TaskDescription& task : AllTasks()) add_family(task.name, task);
    }
  }
  return tasks;
}

Suite::Suite(RunOptions options, const std::vector<std::string>& tasks)
    : tasks_(tasks), folder_(OpenFolder(options)) {
  // Robot and force limits are resolved as in each run of the suite.
  if (!options.sim.robot.empty()) options.sim.robot = std::filesystem::absolute(FindRobot(options.sim.robot));
  options.sim.limits = sim::AbsoluteLimits(options.sim.limits);
  if (std::filesystem::exists(folder_.path() / kSuiteJson)) CheckResumable(folder_.path(), options, tasks);
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (const std::string& task : tasks) runs.push_back(FolderOfTask(task));
  nlohmann::ordered_json json = {{"runs", runs}};
  json.update(OptionsJson(options));
  // Removes the old summary, which is no longer valid.
  std::filesystem::remove(folder_.path() / kSummaryJson);
  folder_.WriteJson(kSuiteJson, json);
}

std::vector<Job> Suite::Jobs(const RunOutput& output) const {
  const std::vector<std::string> json = output.JsonOptions();
  std::vector<Job> jobs;
  for (const std::string& task : tasks_) {
    Job job{task, RunCommand(folder_.path() / kSuiteJson), folder_.log_file(FolderOfTask(task))};
    job.command.insert(job.command.end(),
                       {task, "--out", run_folder(task).string(), "--workers", "1", "--resume"});
    job.command.insert(job.command.end(), json.begin(), json.end());
    jobs.push_back(std::move(job));
  }
  return jobs;
}

const results::Tally& Suite::Ended(const std::string& task) {
  tally_.Add(task, results::ReadRun(run_folder(task)));
  ++num_done_;
  return tally_.of_task(task);
}

bool RunJobs(std::vector<Job> jobs, int at_once, JobsProgress* progress, EventLines* events,
             const std::function<void(const std::string&)>& ended) {
  JobPool pool(std::move(jobs), at_once, [&](const std::string& why) {
    progress->Clear();
    fmt::print("retrying: {}\n", Printable(why));
    if (events) events->Write("remark", {{"text", why}});
  });
  if (events) pool.ReadOutput([&](const std::string& line) { events->Relay(line); });
  for (size_t done = 0; !pool.done() && !stop_requested();) {
    if (const auto name = pool.Poll()) {
      ++done;
      progress->Clear();
      ended(*name);
      std::fflush(stdout);
    } else {
      if (events) events->CheckReader();
      progress->Show(done);
      std::this_thread::sleep_for(kJobPoll);
    }
  }
  progress->Clear();
  return !stop_requested();
}

void RunSuite(RunOptions options, const std::vector<std::string>& tasks, const RunOutput& output) {
  std::optional<EventLines> events;
  if (output.json) events.emplace(output.quiet);
  Suite suite(options, tasks);
  size_t width = 0;
  for (const std::string& task : tasks) width = std::max(width, task.size());

  InstallStopSignals();
  std::optional<WebChild> web;
  if (options.web) {
    web.emplace();
    web->Start(suite.folder().path(), suite.folder().log_file("web"));
  }
  const auto started = std::chrono::steady_clock::now();
  const auto elapsed = [started] {
    return results::FormatDuration(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count());
  };
  const std::set<int> only(options.only.begin(), options.only.end());
  const int episodes = only.empty() ? options.episodes : static_cast<int>(only.size());
  fmt::print("{} of {}  policy {}  seed {}  {} at a time\n",
             Plural(static_cast<int64_t>(tasks.size()), "run"), Plural(episodes, "episode"),
             PolicyName(options), options.seed, options.workers);
  const bool colors = UsesColors(stdout);
  fmt::print("{}", results::Tally::Title("task", width, colors));
  std::fflush(stdout);
  if (events) {
    events->Write("suite_begin", {{"suite", suite.folder().path().string()},
                                  {"tasks", tasks},
                                  {"policy", PolicyName(options)},
                                  {"seed", options.seed},
                                  {"episodes", episodes}});
  }
  std::vector<std::filesystem::path> runs;
  for (const std::string& task : tasks) runs.push_back(suite.run_folder(task));
  JobsProgress progress(tasks.size(), "runs", runs, episodes);
  const auto policy_pool = policy::OpenPool(options.policy, options.workers);
  RunJobs(suite.Jobs(output), options.workers, &progress, events ? &*events : nullptr,
          [&](const std::string& task) { fmt::print("{}", suite.Ended(task).Line(task, width, colors)); });
  suite.WriteSummary();
  if (events) {
    events->Write("suite_summary",
                  {{"summary", ReadJsonFile<nlohmann::ordered_json>(suite.folder().path() / kSummaryJson)}});
  }
  const results::SuiteTally& tally = suite.tally();
  fmt::print("\n{}", results::Tally::Title("family", width, colors));
  for (const auto& [name, family] : tally.families()) fmt::print("{}", family.Line(name, width, colors));
  if (tally.families().size() > 1) fmt::print("{}", tally.all().Line("all", width, colors));
  fmt::print("{}", tally.MeanLine(width));
  const auto shown = suite.folder().shown();
  if (const std::string note = results::InvalidText(tally.all().Summary().invalid, shown.string());
      !note.empty()) {
    fmt::print("\n{}", note);
    if (output.quiet) fmt::print(stderr, "{}", note);
  }
  fmt::print("\n{} of {} runs in {}\nresults  {}\n", suite.num_done(), tasks.size(), elapsed(),
             (shown / "*" / kEpisodesJsonl).string());
  if (suite.num_done() < static_cast<int>(tasks.size())) {
    throw EnvironmentError(fmt::format("stopped after {} of {} runs; to resume, run {}", suite.num_done(),
                                       tasks.size(), results::SameCommand(shown)));
  }
  if (web) web->Stay();
}

}  // namespace evalbus::runner
