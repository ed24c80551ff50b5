// Checks a folder of results: whether its files are those of its manifest, and whether its numbers follow
// from its logs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace evalbus::results {

struct Verification {
  // What is wrong, one line each, beginning with the file.
  std::vector<std::string> findings;
  // What could not be checked, one line each.
  std::vector<std::string> notes;
  // Versions of evalbus that recorded the runs, for example "0.3.0 (c1b69e987838)".
  std::set<std::string> versions;
  int runs = 0, episodes = 0;
  // Pages and comparisons that were made again.
  int pages = 0, comparisons = 0;
  uint64_t files = 0, bytes = 0;

  // Appends what another check found; a finding of both is kept once.
  void Add(const Verification& other);
};

// Compares this folder and all results folders below it with their manifests (manifest.h). Throws InputError
// if the folder is not one of results.
void VerifyHashes(const std::filesystem::path& folder, Verification* result);

// Recomputes the numbers of all runs in this folder: each score from its log, compared with the log's own
// score, with episodes.jsonl and with the episode's summary.json; summary.json of runs and suites from
// episodes.jsonl; the hashes of task and models in run.json. Throws InputError if the folder is not one of
// results.
void VerifyNumbers(const std::filesystem::path& folder, Verification* result);

// Writes manifest.json into all results folders in this folder, the innermost first, and into this one.
// Throws InputError, EnvironmentError.
void WriteManifests(const std::filesystem::path& folder);

}  // namespace evalbus::results
