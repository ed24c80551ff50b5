#include "results/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <string_view>
#include <thread>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/write_whole.h"
#include "results/no_return.h"
#include "results/notes.h"
#include "results/rescorer.h"
#include "results/verdicts.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kFormat = 1;

// Files that mark a results folder. The last two are written by plans/plan_folder.h and plans/certify.h.
constexpr std::array kMarks = {kRunJson, kSuiteJson, "plan.json", "certificate.json"};

// Keys of run.json that depend on the machine or on how the run was started.
constexpr std::array<std::string_view, 16> kMachineKeys = {
    "task_path", "robot", "model_path", "assets", "engine",  "run_id",     "map",       "contract",
    "log",       "url",   "workers",    "video",  "by_hand", "in_process", "git_dirty", "contract_sha256"};

bool IsOfMachine(const std::string& key, const ordered_json& info) {
  // With a contract, "policy" is the address of a server, which depends on the machine; the contract
  // describes the policy.
  if (key == "policy") return info.contains("policy_contract") && info["policy_contract"].is_object();
  // The file of force limits is identified by its hash.
  if (key == "limits") return info.contains("limits_sha256");
  return std::ranges::find(kMachineKeys, key) != kMachineKeys.end();
}

// Returns true for files that are identical in equal runs.
bool IsContent(const std::string& file) {
  const std::string name = fs::path(file).filename().string();
  return name == kEpisodesJsonl || name == kSummaryJson || name == kCollectJson || name == kPhysicsModel ||
         name == kVisualModel || name == "stops.json" || name == "certificate.json";
}

std::string HashOf(const ordered_json& json) { return Sha256Text(ToText(json)); }

// Returns the hash of a manifest without its key "sha256", which contains this hash.
std::string SealOf(ordered_json manifest) {
  manifest.erase("sha256");
  return HashOf(manifest);
}

ordered_json ReadManifest(const fs::path& file) {
  const std::string text = ReadInput(file);
  const auto json = ParseJson<ordered_json>(text, file.string());
  const auto is = [&](const char* key, const ordered_json& value) {
    return json.contains(key) && json[key] == value;
  };
  if (!json.is_object() || !is("sha256", SealOf(json)) || ToText(json, 2) + "\n" != text)
    throw InputError(file.string() + ": changed: its own sha256 does not match");
  if (!is("format", kFormat))
    throw InputError(file.string() + ": not a manifest that this version of evalbus can read");
  return json;
}

void CompareJson(const std::string& where, const ordered_json& before, const ordered_json& now,
                 std::vector<std::string>* findings) {
  const auto differences = Differences(before, now);
  for (const Difference& one : differences)
    findings->push_back(fmt::format("{}: {} {} -> {}", where, one.name, one.before, one.after));
}

}  // namespace

bool IsResultsFolder(const fs::path& folder) {
  return std::ranges::any_of(kMarks, [&](const char* mark) { return fs::is_regular_file(folder / mark); });
}

FolderContents ContentsOf(const fs::path& folder) {
  FolderContents contents;
  for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::recursive_directory_iterator();
       ++entry) {
    const std::string path = fs::relative(entry->path(), folder).generic_string();
    if (entry->is_directory() && IsResultsFolder(entry->path())) {
      contents.folders.push_back(path);
      entry.disable_recursion_pending();
    } else if (entry->is_regular_file() && path != kManifestJson && path != kNotesJson &&
               path != kVerdictsJsonl && path != kNoReturnJson &&
               !ParseTemporaryName(entry->path().filename())) {
      contents.files.push_back(path);
    }
  }
  std::ranges::sort(contents.files);
  std::ranges::sort(contents.folders);
  return contents;
}

std::vector<std::string> HashFiles(const fs::path& folder, const std::vector<std::string>& files,
                                   uint64_t* bytes) {
  std::vector<std::string> hashes(files.size());
  std::atomic<size_t> next = 0;
  std::atomic<uint64_t> sum = 0;
  std::mutex mutex;
  std::string error;
  const auto work = [&] {
    for (size_t i = next++; i < files.size(); i = next++) {
      try {
        hashes[i] = Sha256File(folder / files[i]);
        sum += fs::file_size(folder / files[i]);
      } catch (const std::exception& failure) {
        const std::lock_guard lock(mutex);
        error = failure.what();
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i)
      threads.emplace_back(work);
  }
  if (!error.empty()) throw InputError(error);
  *bytes += sum;
  return hashes;
}

ordered_json MakeManifest(const fs::path& folder) {
  const FolderContents contents = ContentsOf(folder);
  uint64_t bytes = 0;
  const std::vector<std::string> hashes = HashFiles(folder, contents.files, &bytes);
  ordered_json content = ordered_json::object(), machine = ordered_json::object();
  if (fs::exists(folder / kRunJson)) {
    const auto info = ReadJsonFile<ordered_json>(folder / kRunJson);
    for (const auto& [key, value] : info.items())
      (IsOfMachine(key, info) ? machine : content)["run"][key] = value;
  }
  content["files"] = machine["files"] = ordered_json::object();
  for (size_t i = 0; i < hashes.size(); ++i)
    (IsContent(contents.files[i]) ? content : machine)["files"][contents.files[i]] = hashes[i];
  for (const std::string& below : contents.folders) {
    const fs::path file = folder / below / kManifestJson;
    content["folders"][below] = ReadManifest(file).at("content_sha256");
    machine["manifests"][below] = Sha256File(file);
  }
  ordered_json manifest = {{"format", kFormat},
                           {"content_sha256", HashOf(content)},
                           {"content", std::move(content)},
                           {"machine", std::move(machine)}};
  manifest["sha256"] = SealOf(manifest);
  return manifest;
}

ManifestCheck CheckManifest(const fs::path& folder) {
  ManifestCheck check;
  ordered_json manifest;
  try {
    manifest = ReadManifest(folder / kManifestJson);
  } catch (const InputError& error) {
    check.findings.emplace_back(error.what());
    return check;
  }
  const FolderContents contents = ContentsOf(folder);
  const std::vector<std::string> hashes = HashFiles(folder, contents.files, &check.bytes);
  check.files = contents.files.size();
  std::map<std::string, std::string> recorded;
  for (const char* part : {"content", "machine"})
    for (const auto& [file, hash] : manifest.at(part).at("files").items()) recorded[file] = hash;
  for (size_t i = 0; i < hashes.size(); ++i) {
    const std::string& file = contents.files[i];
    const auto found = recorded.find(file);
    if (found == recorded.end()) {
      check.added.push_back((folder / file).string());
      continue;
    }
    if (found->second != hashes[i])
      check.findings.push_back((folder / file).string() +
                               ": changed: its SHA-256 is not that of the manifest");
    recorded.erase(found);
  }
  for (const auto& [file, hash] : recorded)
    check.findings.push_back((folder / file).string() + ": missing; the manifest has it");
  const ordered_json folders = manifest.at("machine").value("manifests", ordered_json::object());
  for (const auto& [below, hash] : folders.items()) {
    const fs::path file = folder / below / kManifestJson;
    if (!fs::exists(file)) {
      check.findings.push_back(file.string() + ": missing; the manifest has it");
    } else if (Sha256File(file) != hash) {
      check.findings.push_back(file.string() + ": changed: its SHA-256 is not that of the manifest");
    }
  }
  if (fs::exists(folder / kRunJson)) {
    try {
      ordered_json run = ordered_json::object();
      for (const char* part : {"content", "machine"}) {
        if (manifest[part].contains("run")) run.update(manifest[part]["run"]);
      }
      CompareJson((folder / kRunJson).string(), run, ReadJsonFile<ordered_json>(folder / kRunJson),
                  &check.findings);
    } catch (const InputError& error) {
      check.findings.emplace_back(error.what());
    }
  }
  return check;
}

}  // namespace evalbus::results
