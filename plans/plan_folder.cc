#include "plans/plan_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "base/errors.h"
#include "base/file_errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/this_process.h"
#include "base/write_whole.h"
#include "models/task_description.h"
#include "results/rescorer.h"
#include "results/run_folder.h"
#include "runner/suite.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

fs::path Hidden(const PlanFolder& folder, const Shard& shard, const std::string& ending) {
  return folder.path() / kPartsFolder / fmt::format(".{}.{}", shard.name(), ending);
}

// Returns a key of plan.json as the plan's file has it, in quotes. plan: plan.json, for the names of
// policies.
std::string KeyInFile(const std::string& name, const nlohmann::ordered_json& plan) {
  const std::string options = "options.", policies = "policies.";
  if (name == "options.episodes" || name == "options.seed") return '"' + name.substr(options.size()) + '"';
  if (name == "baseline") return "\"compare.baseline\"";
  const size_t dot = name.find('.', policies.size());
  if (!name.starts_with(policies) || dot == std::string::npos) return '"' + name + '"';
  const auto index = static_cast<size_t>(std::stoi(name.substr(policies.size())));
  const auto& listed = plan.at("policies");
  const std::string key = '"' + name.substr(dot + 1) + '"';
  const std::string policy = index < listed.size() ? listed[index].value("name", "") : "";
  if (policy.empty() || name.ends_with(".name")) return fmt::format("{} of policy {}", key, index + 1);
  return fmt::format("{} of policy '{}'", key, policy);
}

// Returns the difference to report: the first one that is an entry of the plan's file, if there is one.
const results::Difference& ReportedDifference(const std::vector<results::Difference>& differences) {
  const auto found = std::ranges::find_if(
      differences, [](const auto& difference) { return !difference.name.ends_with("_is_given"); });
  return found == differences.end() ? differences.front() : *found;
}

// Returns what to do about a difference. If a task file of the plan was moved, names its former folder.
std::string Advice(const results::Difference& difference) {
  const std::string other = "; choose another folder, or undo the change";
  if (!difference.name.starts_with("tasks.")) return other;
  const auto file_of = [](std::string text) {
    std::erase(text, '"');
    const fs::path path(text);
    return IsTaskFile(path.parent_path()) ? path.parent_path() : path;
  };
  const fs::path before = file_of(difference.before), now = file_of(difference.after);
  if (!IsTaskFile(before) || before == now || before.filename() != now.filename()) return other;
  return fmt::format(
      "; a task file is identified by its path: put '{}' into {}, or evaluate the plan in another folder",
      now.filename().string(), before.parent_path().string());
}

}  // namespace

std::string Shard::name() const {
  return fmt::format("{}{:04}-{:04}", ShardPrefix(policy, task), first, last);
}

std::vector<Shard> ShardsOf(const Plan& plan) {
  std::vector<Shard> shards;
  for (const PlannedPolicy& policy : plan.policies) {
    for (const std::string& task : plan.tasks) {
      for (int first = 0; first < plan.options.episodes; first += plan.shard_episodes) {
        shards.push_back(
            {policy.name, task, first, std::min(first + plan.shard_episodes, plan.options.episodes) - 1});
      }
    }
  }
  return shards;
}

std::vector<Shard> ShardsOfPart(const std::vector<Shard>& shards, int part, int parts) {
  std::vector<Shard> mine;
  for (size_t i = static_cast<size_t>(part - 1); i < shards.size(); i += static_cast<size_t>(parts)) {
    mine.push_back(shards[i]);
  }
  return mine;
}

PlanFolder::PlanFolder(const Plan& plan, const fs::path& out, bool make)
    : plan_(plan),
      path_(fs::absolute(out.empty() ? results::DatedFolder(plan.name) : out).lexically_normal()) {
  if (!path_.has_filename()) path_ = path_.parent_path();
  const fs::path file = path_ / kPlanJson;
  if (make) {
    std::error_code error;
    fs::create_directories(path_ / kPartsFolder, error);
    if (error) ThrowFileError("--out " + path_.string() + ": cannot create", error.value());
  } else if (!fs::exists(file)) {
    return;
  }
  const auto json = PlanJson(plan_);
  if (!fs::exists(file)) {
    for (const auto& entry : fs::directory_iterator(path_)) {
      if (entry.path().filename() == kPartsFolder || ParseTemporaryName(entry.path().filename())) continue;
      throw InputError("--out " + path_.string() + ": exists and is not a plan's folder; it has no " +
                       kPlanJson);
    }
    // Another part of the plan may begin at the same time and also write the file, but with the same
    // contents.
    WriteWhole(file, ToText(json, 2) + "\n");
    return;
  }
  const auto before = ReadJsonFile<nlohmann::ordered_json>(file);
  const auto differences = results::Differences(before, json);
  if (differences.empty()) return;
  const results::Difference& difference = ReportedDifference(differences);
  throw InputError(fmt::format("--out {}: the plan in this folder differs: {} is {} there, not {}{}",
                               file.string(), KeyInFile(difference.name, before), difference.before,
                               difference.after, Advice(difference)));
}

PlanFolder::PlanFolder(const fs::path& folder) : path_(fs::absolute(folder).lexically_normal()) {
  if (!path_.has_filename()) path_ = path_.parent_path();
  const fs::path file = path_ / kPlanJson;
  if (!fs::exists(file)) throw InputError(folder.string() + ": not a plan's folder; it has no " + kPlanJson);
  plan_ = PlanOfJson(ReadJsonFile(file), file.string());
}

fs::path PlanFolder::run_folder(const std::string& policy, const std::string& task) const {
  return policy_folder(policy) / FolderOfTask(task);
}

bool PlanFolder::has_run(const std::string& policy, const std::string& task) const {
  const fs::path run = run_folder(policy, task);
  if (!fs::exists(run / kSummaryJson)) return false;
  if (plan_.until || whole_.contains(run)) return true;
  // An interrupted run also has a summary.
  if (CountLines(run / kEpisodesJsonl) < plan_.options.episodes) return false;
  whole_.insert(run);
  return true;
}

void PlanFolder::CheckNoneIsInterrupted() const {
  for (const PlannedPolicy& policy : plan_.policies) {
    for (const std::string& task : plan_.tasks) {
      const fs::path run = run_folder(policy.name, task);
      if (!fs::exists(run) || has_run(policy.name, task)) continue;
      throw InputError(fmt::format(
          "{}: {} of {} episodes, of a run without --part that was interrupted or is still running; finish "
          "it "
          "with 'evalbus run PLAN --out {} --resume', or remove its folder",
          run.string(), CountLines(run / kEpisodesJsonl), plan_.options.episodes, path_.string()));
    }
  }
}

bool PlanFolder::has(const Shard& shard) const {
  return fs::exists(shard_folder(shard)) || has_run(shard.policy, shard.task);
}

void PlanFolder::Put(const Shard& shard, const fs::path& finished) const {
  // Another process has finished the shard, or the shard has been merged.
  if (has(shard)) return;
  const fs::path coming = Hidden(*this, shard, ThisProcess() + ".coming");
  std::error_code ignored;
  try {
    fs::remove_all(coming);
    fs::create_directories(coming.parent_path());
    fs::copy(finished, coming, fs::copy_options::recursive);
    // Contents are synced before the rename, because other machines must not see the final name without its
    // contents.
    for (const auto& entry : fs::recursive_directory_iterator(coming)) SyncToDisk(entry.path(), fsync);
  } catch (const fs::filesystem_error& error) {
    fs::remove_all(coming, ignored);
    // Another process's copy of the shard has been merged, and the merge removed this copy.
    if (has(shard)) return;
    ThrowFileError("cannot write " + coming.string(), error.code().value());
  } catch (...) {
    fs::remove_all(coming, ignored);
    throw;
  }
  if (rename(coming.c_str(), shard_folder(shard).c_str()) == 0) return;
  const int error = errno;
  fs::remove_all(coming, ignored);
  // Another process may have stored the same shard in the meantime, which is not an error.
  if (!has(shard)) ThrowFileError("cannot write " + shard_folder(shard).string(), error);
}

AtWork::AtWork(const PlanFolder& folder, const Shard& shard)
    : file_(Hidden(folder, shard, ThisProcess())), refreshed_(std::chrono::steady_clock::now()) {
  WriteWhole(file_, "");
}

AtWork::~AtWork() {
  std::error_code ignored;
  fs::remove(file_, ignored);
}

void AtWork::Refresh() {
  const auto now = std::chrono::steady_clock::now();
  if (now - refreshed_ < kRefreshPeriod) return;
  refreshed_ = now;
  // Sets the time stamp to the current time of the machine that stores the file.
  if (utimensat(AT_FDCWD, file_.c_str(), nullptr, 0) == 0) return;
  // ENOENT means that another process has finished the same shard and that its results were merged.
  const int error = errno;
  if (error == ENOENT) return;
  fmt::print(stderr,
             "warning: {}: cannot be updated ({}); 'evalbus status' will show this shard as stopped\n",
             file_.string(), std::strerror(error));
}

std::pair<std::string, std::string> ParseHidden(const std::string& name) {
  const size_t plus = name.rfind('+');
  if (!name.starts_with(".") || plus == std::string::npos) return {};
  const size_t dot = std::min(name.find('.', plus), name.size());
  return {name.substr(1, dot - 1), dot < name.size() ? name.substr(dot + 1) : ""};
}

void SyncToDisk(const fs::path& path, int (*sync)(int)) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool good = fd >= 0 && sync(fd) == 0;
  const int error = errno;
  if (fd >= 0) close(fd);
  if (!good) ThrowFileError("cannot write " + path.string(), error);
}

void CheckOutIsNew(const fs::path& out) {
  if (!fs::exists(out) || (fs::is_directory(out) && fs::is_empty(out))) return;
  throw InputError("--out " + out.string() +
                   ": exists and is not an empty folder; choose another name, or add --resume");
}

void WriteFailure(const PlanFolder& folder, const Shard& shard, const std::string& why) {
  const fs::path file = Hidden(folder, shard, "failed");
  std::error_code ignored;
  if (why.empty()) {
    fs::remove(file, ignored);
  } else {
    WriteWhole(file, why + "\n");
  }
}

}  // namespace evalbus::plans
