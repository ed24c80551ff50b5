#include "plans/slurm.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "base/errors.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "plans/probe.h"
#include "policy_bridge/wire/url.h"
#include "runner/processes.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

// Target duration of one task of the array, in seconds.
constexpr double kTask_s = 600;
constexpr int kProbes = 4;
// Slurm's default limit on the size of a job array.
constexpr int kMaxTasks = 1000;

std::string Evalbus() { return (runner::Processes::BinaryFolder() / "evalbus").string(); }

// Quotes a value for a line "#SBATCH --OPTION=VALUE" if necessary, because the value ends at the first
// unquoted blank. Throws InputError if the value contains a line break, which would end the line.
std::string SbatchValue(const std::string& text) {
  if (text.find_first_of("\r\n") != std::string::npos)
    throw InputError("--slurm: expected names without line breaks, got '" + Printable(text) + "'");
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  quoted += '"';
  const bool is_plain = text.find_first_of(" \t\"'\\#") == std::string::npos;
  return is_plain ? text : quoted;
}

// Returns the value of --output for a file in a folder. Escapes "%" in the folder's name, because sbatch
// replaces patterns such as "%a".
std::string OutputPattern(const fs::path& folder, const char* file) {
  std::string pattern;
  for (const char c : folder.string()) pattern += c == '%' ? "%%" : std::string(1, c);
  return SbatchValue(pattern + "/" + file);
}

// Returns a command's output; throws EnvironmentError with the output if the command fails.
std::string OutputOf(const std::vector<std::string>& command) {
  FILE* const pipe = popen((ShellWords(command) + " 2>&1").c_str(), "r");
  if (!pipe)
    throw EnvironmentError(std::string("cannot start a process for sbatch: ") + std::strerror(errno));
  std::string output;
  char part[512];
  for (size_t n = 0; (n = fread(part, 1, sizeof part, pipe)) > 0;) output.append(part, n);
  const int status = pclose(pipe);
  while (output.ends_with('\n')) output.pop_back();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return output;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) {
    throw EnvironmentError(
        "sbatch is missing: --slurm requires a machine of a Slurm cluster; --slurm-dry-run shows the "
        "scripts");
  }
  std::string lines;
  for (const char c : output) lines += c == '\n' ? "; " : std::string(1, c);
  throw EnvironmentError(command[0] + ": " + Printable(lines));
}

// Submits a script and returns its job number. Prints the other lines of sbatch, for example warnings of the
// cluster's plugins. Throws EnvironmentError.
std::string Submit(const fs::path& script, const std::vector<std::string>& options = {}) {
  std::vector<std::string> command = {"sbatch", "--parsable"};
  command.insert(command.end(), options.begin(), options.end());
  command.push_back(script.string());
  std::istringstream output(OutputOf(command));
  std::string job, others;
  for (std::string line; std::getline(output, line);) {
    // The line with the number is "NUMBER" or "NUMBER;CLUSTER".
    const std::string number = line.substr(0, line.find(';'));
    if (!number.empty() && std::ranges::all_of(number, [](char c) { return c >= '0' && c <= '9'; })) {
      job = number;
    } else {
      others += Printable(line) + "\n";
    }
  }
  fmt::print(stderr, "{}", others);
  if (job.empty()) throw EnvironmentError("sbatch printed no job number for " + script.string());
  return job;
}

// Prints a warning if policies have servers that a compute node would look for on itself.
void WarnOfLoopback(const Plan& plan) {
  std::vector<std::string> own = plan.Servers();
  std::erase_if(own, [](const std::string& url) { return !policy::IsLoopback(url); });
  if (own.empty()) return;
  fmt::print(stderr,
             "warning: {}: each compute node looks for this server on itself; use an address that all "
             "nodes can reach\n",
             Printable(fmt::format("{}", fmt::join(own, ", "))));
}

int NumParts(const Plan& plan, const SlurmOptions& options) {
  const int shards = static_cast<int>(ShardsOf(plan).size());
  if (options.array_size > 0) return std::min(options.array_size, shards);
  const Probe probe = ProbePlan(plan, kProbes);
  if (probe.episodes == 0) {
    throw InputError(
        "--slurm requires --array-size, the number of array tasks: no episode can be tried here, " +
        Printable(probe.problem));
  }
  const double all_s = probe.seconds_per_episode * plan.num_runs() * plan.options.episodes / options.cpus;
  const int parts =
      std::clamp(static_cast<int>(std::min(std::ceil(all_s / kTask_s), 1e6)), 1, std::min(shards, kMaxTasks));
  fmt::print("an episode takes {:.2g} s on this machine; the plan needs {} of about {:.0f} min each\n",
             probe.seconds_per_episode, Plural(parts, "array task"), std::max(1.0, all_s / parts / 60));
  return parts;
}

}  // namespace

SlurmScripts WriteSlurmScripts(const PlanFolder& folder, const SlurmOptions& options, int parts) {
  folder.CheckNoneIsInterrupted();
  SlurmScripts scripts;
  scripts.parts = parts;
  const std::vector<Shard> shards = ShardsOf(folder.plan());
  for (int part = 1; part <= parts; ++part) {
    const std::vector<Shard> mine = ShardsOfPart(shards, part, parts);
    if (!std::ranges::all_of(mine, [&](const Shard& shard) { return folder.has(shard); })) {
      scripts.todo.push_back(part);
    }
  }
  const fs::path own = folder.path() / kSlurmFolder;
  std::string where;
  if (!options.partition.empty()) where += "#SBATCH --partition=" + SbatchValue(options.partition) + "\n";
  std::string limits = where;
  if (!options.time.empty()) limits += "#SBATCH --time=" + SbatchValue(options.time) + "\n";
  const bool is_all = static_cast<int>(scripts.todo.size()) == parts;
  // With --open-mode=append, a requeued task appends to its log instead of truncating it.
  scripts.array = fmt::format(
      "#!/bin/sh\n"
      "#SBATCH --job-name={name}\n"
      "#SBATCH --array={array}\n"
      "#SBATCH --cpus-per-task={cpus}\n"
      "#SBATCH --requeue\n"
      "#SBATCH --open-mode=append\n"
      "#SBATCH --output={log}\n"
      "{limits}"
      "exec {evalbus} run {plan} --part \"$SLURM_ARRAY_TASK_ID/{parts}\" --workers {cpus}\n",
      fmt::arg("name", SbatchValue("evalbus-" + folder.plan().name)),
      fmt::arg("array",
               is_all ? fmt::format("1-{}", parts) : fmt::format("{}", fmt::join(scripts.todo, ","))),
      fmt::arg("cpus", options.cpus), fmt::arg("log", OutputPattern(own, "part-%a.log")),
      fmt::arg("limits", limits), fmt::arg("evalbus", ShellWords({Evalbus()})),
      fmt::arg("plan", ShellWords({(folder.path() / kPlanJson).string()})), fmt::arg("parts", parts));
  scripts.merge = fmt::format(
      "#!/bin/sh\n"
      "#SBATCH --job-name={}\n"
      "#SBATCH --requeue\n"
      "#SBATCH --open-mode=append\n"
      "#SBATCH --output={}\n"
      "{}"
      "exec {} merge {}\n",
      SbatchValue("evalbus-" + folder.plan().name + "-merge"), OutputPattern(own, "merge.log"), where,
      ShellWords({Evalbus()}), ShellWords({folder.path().string()}));
  return scripts;
}

void RunOnSlurm(const PlanFolder& folder, const SlurmOptions& options) {
  const std::vector<Shard> shards = ShardsOf(folder.plan());
  if (std::ranges::all_of(shards, [&](const Shard& shard) { return folder.has(shard); })) {
    const bool is_merged = std::ranges::all_of(
        shards, [&](const Shard& shard) { return folder.has_run(shard.policy, shard.task); });
    throw InputError(folder.path().string() +
                     (is_merged ? ": all episodes exist and are merged"
                                : ": every shard exists; 'evalbus merge " + folder.path().string() +
                                      "' combines them into results"));
  }
  WarnOfLoopback(folder.plan());
  const SlurmScripts scripts = WriteSlurmScripts(folder, options, NumParts(folder.plan(), options));
  const fs::path own = folder.path() / kSlurmFolder;
  if (options.dry_run) {
    const std::string array = (own / "array.sh").string(), merge = (own / "merge.sh").string();
    fmt::print("{}:\n{}\n{}:\n{}\ncommands:\n{}\n{}\n", array, scripts.array, merge, scripts.merge,
               ShellWords({"sbatch", "--parsable", array}),
               ShellWords({"sbatch", "--parsable", "--dependency=afterany:JOB", merge}));
    return;
  }
  fs::create_directories(own);
  WriteWhole(own / "array.sh", scripts.array);
  WriteWhole(own / "merge.sh", scripts.merge);
  const std::string job = Submit(own / "array.sh");
  std::string merge;
  try {
    merge = Submit(own / "merge.sh", {"--dependency=afterany:" + job});
  } catch (const EnvironmentError& error) {
    throw EnvironmentError(fmt::format("{}; the array was submitted as job {}: merge its results with {}",
                                       error.what(), job,
                                       ShellWords({"evalbus", "merge", folder.path().string()})));
  }
  fmt::print("array    job {}, {}\nmerge    job {}\nfolder   {}\nprogress {}\n", job,
             Plural(scripts.todo.size(), "task"), merge, folder.path().string(),
             ShellWords({"evalbus", "status", folder.path().string()}));
}

}  // namespace evalbus::plans
