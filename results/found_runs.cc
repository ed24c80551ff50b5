#include "results/found_runs.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/plan_layout.h"
#include "base/run_layout.h"
#include "base/suggestion.h"
#include "base/text.h"
#include "results/run_reader.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;

// Returns the finished shards of a run, ordered by episode.
std::vector<FoundRun> ShardsOfRun(const fs::path& plan, const std::string& policy, const std::string& task,
                                  int planned) {
  std::vector<FoundRun> shards;
  std::error_code gone;
  for (auto entry = fs::directory_iterator(plan / kPartsFolder, gone);
       !gone && entry != fs::directory_iterator(); entry.increment(gone)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(ShardPrefix(policy, task)) || !fs::exists(entry->path() / kRunJson)) continue;
    shards.push_back({entry->path(), policy, name, planned});
  }
  std::ranges::sort(shards, {}, &FoundRun::name);
  return shards;
}

// Throws InputError unless `name` can be the name of a folder in the plan's folder.
void CheckFolderName(const std::string& name, const fs::path& file) {
  if (!name.empty() && name[0] != '.' && name.find('/') == std::string::npos) return;
  throw InputError(file.string() + ": \"" + Printable(name) + "\" is not the name of a policy or a task");
}

FoundRuns FindRunsOfPlan(const fs::path& folder) {
  const fs::path file = folder / kPlanJson;
  const auto json = ReadJsonFile(file);
  FoundRuns found;
  try {
    found.baseline = json.at("baseline").get<std::string>();
    const auto until = json.find("until");
    found.is_sequential = until != json.end() && !until->is_null();
    const auto options = json.find("options");
    const int planned = options == json.end() ? 0 : options->value("episodes", 0);
    found.tasks = json.at("tasks").get<std::vector<std::string>>();
    for (const auto& listed : json.at("policies")) {
      const auto policy = listed.at("name").get<std::string>();
      CheckFolderName(policy, file);
      found.policies.push_back(policy);
      for (const std::string& task : found.tasks) {
        CheckFolderName(FolderOfTask(task), file);
        const FoundRun whole = {folder / policy / FolderOfTask(task), policy,
                                policy + "/" + FolderOfTask(task), planned};
        std::vector<FoundRun> shards;
        if (!fs::exists(whole.folder / kRunJson)) shards = ShardsOfRun(folder, policy, task, planned);
        if (shards.empty()) shards.push_back(whole);
        std::ranges::move(shards, std::back_inserter(found.runs));
      }
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError(
        file.string() +
        ": not a plan that evalbus has written: expected the keys \"policies\", \"tasks\" and \"baseline\"");
  }
  return found;
}

}  // namespace

bool IsEvaluation(const fs::path& folder) {
  return fs::exists(folder / kRunJson) || fs::exists(folder / kSuiteJson) || fs::exists(folder / kPlanJson);
}

std::string SimilarFolder(const fs::path& missing) {
  const fs::path folder = missing.has_filename() ? missing : missing.parent_path();
  const fs::path parent = folder.parent_path();
  std::vector<std::string> names;
  std::error_code ignored;
  for (fs::directory_iterator entry(parent.empty() ? "." : parent, ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    const fs::path& there = entry->path();
    const bool has_any = fs::exists(there / kRunJson, ignored) || fs::exists(there / kSuiteJson, ignored) ||
                         fs::exists(there / kPlanJson, ignored);
    ignored.clear();
    if (has_any) names.push_back(there.filename().string());
  }
  std::ranges::sort(names);
  const std::string nearest = NearestName(folder.filename().string(), names);
  return nearest.empty() ? "" : "; did you mean '" + Printable((parent / nearest).string()) + "'?";
}

FoundRuns FindRuns(const fs::path& folder) {
  CheckRunFolder(folder);
  if (fs::exists(folder / kPlanJson)) return FindRunsOfPlan(folder);
  FoundRuns found;
  if (!fs::exists(folder / kSuiteJson)) {
    found.runs.push_back({.folder = folder, .policy = "", .name = NameOfRun(folder)});
    return found;
  }
  for (const std::string& name : RunsInSuite(folder)) {
    found.runs.push_back({.folder = folder / name, .policy = "", .name = NameOfRun(folder) + "/" + name});
  }
  return found;
}

}  // namespace evalbus::results
