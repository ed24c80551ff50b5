// Checks a folder of results: whether its files match its manifest, and whether its numbers can be recomputed
// from its logs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace evalbus::results {

struct Verification {
  // Errors, one line each, beginning with the file.
  std::vector<std::string> findings;
  // Notes on what could not be checked, one line each.
  std::vector<std::string> notes;
  // Versions of evalbus that recorded the runs, for example "0.3.0 (c1b69e987838)".
  std::set<std::string> versions;
  int runs = 0, episodes = 0;
  // Number of pages and comparisons that were generated again.
  int pages = 0, comparisons = 0;
  uint64_t files = 0, bytes = 0;

  // Adds the result of another check. A finding of both checks is kept once.
  void Add(const Verification& other);
};

// Compares this folder and all results folders below it with their manifests (manifest.h). Throws InputError
// if the folder is not a results folder.
void VerifyHashes(const std::filesystem::path& folder, Verification* result);

// Recomputes the numbers of all runs in this folder. Scores are computed from the logs and compared with the
// recorded scores, episodes.jsonl and the episodes' summary.json. summary.json of runs and suites is computed
// from episodes.jsonl. The hashes of task and models in run.json are also checked. Throws InputError if the
// folder is not a results folder.
void VerifyNumbers(const std::filesystem::path& folder, Verification* result);

// Writes manifest.json into this folder and all results folders in it, the innermost first. Throws
// InputError or EnvironmentError.
void WriteManifests(const std::filesystem::path& folder);

}  // namespace evalbus::results
