// Implements `evalbus verify`, which checks that recorded results are unchanged and follow from the logs.

#include <fmt/format.h>

#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <string>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/plan_layout.h"
#include "base/text.h"
#include "cli/commands/commands.h"
#include "plans/page_verification.h"
#include "plans/plan_folder.h"
#include "plans/status.h"
#include "plans/stop_rule.h"
#include "results/manifest.h"
#include "results/rescorer.h"
#include "results/verification.h"
#include "runner/version.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

struct VerifyOptions {
  fs::path folder;
  // Checks only hashes and computes no scores.
  bool hashes = false;
  // Writes manifest.json if there are no findings.
  bool write = false;
};

void AddOptions(CLI::App* app, VerifyOptions* options) {
  app->add_option("folder", options->folder, "folder of a run, a suite or a plan")->required();
  auto* const hashes = app->add_flag("--hashes", options->hashes,
                                     "compare files with manifest.json only, without computing scores again");
  app->add_flag("--write", options->write,
                "if nothing is wrong, write manifest.json with the SHA-256 of each file; an existing one is "
                "replaced,\nand not compared with the files")
      ->excludes(hashes);
}

// Compares stops.json, which only a plan with `until` has, with the decisions computed from the plan's
// episodes.
void VerifyStops(const fs::path& folder, results::Verification* result) {
  const fs::path file = folder / plans::kStopsJson;
  if (!fs::exists(folder / kPlanJson) || !fs::exists(file)) return;
  try {
    const auto stored = ReadJsonFile<nlohmann::ordered_json>(file);
    // The computed value is written and parsed, so that it is rounded like the file.
    const auto computed = nlohmann::ordered_json::parse(ToText(plans::StopsJson(plans::PlanFolder(folder))));
    for (const results::Difference& one : results::Differences(stored, computed)) {
      result->findings.push_back(
          fmt::format("{}: {} is {}, recomputed {}", file.string(), one.name, one.before, one.after));
    }
  } catch (const InputError& error) {
    result->findings.push_back(error.what());
  }
}

// Adds a note if the folder is that of a plan that has not finished.
void NoteProgress(const fs::path& folder, results::Verification* result) {
  if (!fs::exists(folder / kPlanJson)) return;
  try {
    const plans::PlanStatus status = plans::StatusOf(plans::PlanFolder(folder));
    if (status.has_ended || status.done >= status.episodes) return;
    result->notes.push_back(fmt::format("{}: the plan has not finished: {} of {}{} episodes", folder.string(),
                                        status.done, status.is_sequential ? "at most " : "",
                                        status.episodes));
  } catch (const InputError& error) {
    result->findings.push_back(error.what());
  }
}

// Returns 0 if there are no findings; otherwise 1. Throws InputError or EnvironmentError.
int Verify(const VerifyOptions& options) {
  // Hashing runs on its own thread, because the other checks use only one processor.
  auto hashing = std::async(std::launch::async, [&] {
    results::Verification hashed;
    if (!options.write) results::VerifyHashes(options.folder, &hashed);
    return hashed;
  });
  results::Verification recomputed;
  if (!options.hashes) {
    NoteProgress(options.folder, &recomputed);
    results::VerifyNumbers(options.folder, &recomputed);
    VerifyStops(options.folder, &recomputed);
    plans::VerifyPages(options.folder, &recomputed);
  }
  results::Verification result = hashing.get();
  result.Add(recomputed);
  if (options.hashes && result.files == 0 && result.findings.empty()) {
    throw InputError(fmt::format("{}: no {}, so there is nothing to compare; {} writes it",
                                 options.folder.string(), results::kManifestJson,
                                 ShellWords({"evalbus", "verify", options.folder.string(), "--write"})));
  }
  for (const std::string& finding : result.findings) fmt::print("{}\n", Printable(finding));
  for (const std::string& note : result.notes) fmt::print("note: {}\n", Printable(note));
  const std::string version = fmt::format("{} ({})", kVersion, kGitCommit);
  for (const std::string& other : result.versions) {
    if (other != version)
      fmt::print("note: recorded by evalbus {}, recomputed by {}\n", Printable(other), version);
  }
  std::string what;
  const auto add = [&](const std::string& part) { what += (what.empty() ? "" : "; ") + part; };
  if (result.files > 0)
    add(fmt::format("{} hashed, {:.1f} MB", Plural(static_cast<int64_t>(result.files), "file"),
                    static_cast<double>(result.bytes) / 1e6));
  if (!options.hashes)
    add(fmt::format("{} of {} scored again", Plural(result.episodes, "episode"), Plural(result.runs, "run")));
  if (result.pages > 0) add(Plural(result.pages, "page") + " made again");
  if (result.comparisons > 0) add(Plural(result.comparisons, "comparison") + " made again");
  if (!result.findings.empty()) {
    fmt::print("{}: {}\n", Plural(static_cast<int64_t>(result.findings.size()), "finding"), what);
    return 1;
  }
  fmt::print("no finding: {}\n", what);
  if (options.write) {
    results::WriteManifests(options.folder);
    fmt::print("manifest  {}\n", (options.folder / results::kManifestJson).string());
  }
  return 0;
}

}  // namespace

Action AddVerify(CLI::App* app) { return ActionOf<VerifyOptions>(app, AddOptions, Verify); }

}  // namespace evalbus::commands
