#include "cli/launch/suite.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/host.h"
#include "cli/launch/job_pool.h"
#include "cli/launch/prepared_run.h"
#include "cli/launch/web_child.h"
#include "cli/launch/workers.h"
#include "cli/results/run_folder.h"
#include "cli/results/run_reader.h"
#include "cli/results/summary_table.h"
#include "cli/results/tally.h"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus::launch {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(20);

std::string FolderName(std::string task) {
  std::replace(task.begin(), task.end(), '/', '-');
  return task;
}

// Throws InputError if the suite was made differently or has runs that would not be in it any more. Further
// ones may come in.
void CheckResumable(const std::filesystem::path& folder, const RunOptions& options,
                    const std::vector<std::string>& tasks) {
  const std::filesystem::path file = folder / kSuiteJson;
  CheckFixedOptions(file, ReadJsonFile<nlohmann::ordered_json>(file), options);
  std::set<std::string> wanted;
  for (const std::string& task : tasks) wanted.insert(FolderName(task));
  for (const std::string& run : results::RunsInSuite(folder)) {
    if (wanted.contains(run)) continue;
    throw InputError("--resume: " + file.string() + ": the suite has the run " + run +
                     "; name its task, too, or begin another suite");
  }
}

}  // namespace

std::vector<std::string> ExpandTasks(const std::vector<std::string>& names) {
  std::vector<std::string> tasks;
  std::set<std::string> seen;
  std::map<std::string, std::string> by_folder;
  const auto add = [&](const std::string& name) {
    if (!seen.insert(name).second) throw InputError("task '" + name + "' is there twice");
    const auto [other, is_new] = by_folder.emplace(FolderName(name), name);
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
      // A file is known by its path alone.
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

void RunSuite(RunOptions options, const std::vector<std::string>& tasks) {
  // As each of its runs will have it.
  if (!options.sim.robot.empty()) options.sim.robot = std::filesystem::absolute(FindRobot(options.sim.robot));
  const results::RunFolder suite =
      results::RunFolder::OfSuite(options.out, "suite-" + ShortPolicyName(options), options.resume);
  if (std::filesystem::exists(suite.path() / kSuiteJson)) CheckResumable(suite.path(), options, tasks);

  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  std::vector<Job> jobs;
  size_t width = 0;
  for (const std::string& task : tasks) {
    runs.push_back(FolderName(task));
    width = std::max(width, task.size());
    Job job{task, RunCommand(suite.path() / kSuiteJson), suite.log_file(FolderName(task))};
    const auto folder = suite.path() / FolderName(task);
    job.command.insert(job.command.end(), {task, "--out", folder.string(), "--workers", "1", "--resume"});
    jobs.push_back(std::move(job));
  }
  nlohmann::ordered_json json = {{"runs", runs}};
  json.update(OptionsJson(options));
  // What it says ends here.
  std::filesystem::remove(suite.path() / kSummaryJson);
  suite.WriteJson(kSuiteJson, json);

  InstallStopSignals();
  std::optional<WebChild> web;
  if (options.web) {
    web.emplace();
    web->Start(suite.path(), suite.log_file("web"));
  }
  const auto started = std::chrono::steady_clock::now();
  const auto elapsed = [started] {
    return results::FormatDuration(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count());
  };
  fmt::print("{} runs of {} episode{}  policy {}  seed {}  {} at a time\n", tasks.size(), options.episodes,
             options.episodes == 1 ? "" : "s", PolicyName(options), options.seed, options.workers);
  fmt::print("{}", results::Tally::Title("task", width));
  std::fflush(stdout);
  const bool is_terminal = isatty(fileno(stdout)) != 0;
  JobPool pool(std::move(jobs), options.workers, [&](const std::string& why) {
    fmt::print("{}begun again: {}\n", is_terminal ? "\x1b[K" : "", Printable(why));
  });
  std::map<std::string, results::Tally> variations, families;
  results::Tally all;
  int done = 0;
  const auto progress = [&] {
    if (!is_terminal) return;
    fmt::print("\x1b[K{} of {} runs, {}\r", done, tasks.size(), elapsed());
    std::fflush(stdout);
  };
  while (!pool.done() && !stop_requested()) {
    if (const auto ended = pool.Poll()) {
      const results::RecordedRun run = results::ReadRun(suite.path() / FolderName(*ended));
      results::Tally& tally = variations[*ended];
      tally.Add(run);
      families[run.task].Add(run);
      all.Add(run);
      ++done;
      fmt::print("{}{}", is_terminal ? "\x1b[K" : "", tally.Line(*ended, width));
      std::fflush(stdout);
    } else {
      progress();
      std::this_thread::sleep_for(kPoll);
    }
  }
  if (is_terminal) fmt::print("\x1b[K");
  nlohmann::ordered_json summary = {{"all", all.Json()}};
  for (const auto& [name, tally] : families) summary["by_task"][name] = tally.Json();
  for (const std::string& task : tasks) {
    if (variations.contains(task)) summary["by_variation"][task] = variations[task].Json();
  }
  suite.WriteJson(kSummaryJson, summary);
  fmt::print("\n{}", results::Tally::Title("family", width));
  for (const auto& [name, tally] : families) fmt::print("{}", tally.Line(name, width));
  if (families.size() > 1) fmt::print("{}", all.Line("all", width));
  const auto shown = suite.shown();
  if (const std::string note = results::InvalidText(all.invalid(), shown.string()); !note.empty()) {
    fmt::print("\n{}", note);
  }
  fmt::print("\n{} of {} runs in {}\nresults  {}\n", done, tasks.size(), elapsed(),
             (shown / "*" / kEpisodesJsonl).string());
  if (done < static_cast<int>(tasks.size())) {
    throw EnvironmentError(
        fmt::format("stopped after {} of {} runs; the same command with --out {} --resume goes on", done,
                    tasks.size(), shown.string()));
  }
  if (web) web->Stay();
}

}  // namespace evalbus::launch
