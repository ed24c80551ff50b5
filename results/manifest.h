// manifest.json of a folder of results: the SHA-256 of each file that FolderContents lists, so that any later
// change is found. docs/verify.md describes the format.
//
// `content` is equal for equal runs, on any machine and with any number of workers; `machine` depends on
// machine and time: logs, paths, run.json as a whole. A folder whose subfolders are runs (a suite, a plan)
// has their content_sha256 in its content; each of them has its own manifest.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace evalbus::results {

inline constexpr char kManifestJson[] = "manifest.json";

// Returns whether the folder contains the results of a run, a suite, a plan or a certificate.
bool IsResultsFolder(const std::filesystem::path& folder);

// The files of a results folder, sorted and relative to it, and the results folders below it. Excluded are
// manifest.json, temporary files, and the files that commands may change at any time: notes.json,
// verdicts.jsonl and no_return.json.
struct FolderContents {
  std::vector<std::string> files;
  std::vector<std::string> folders;
};
FolderContents ContentsOf(const std::filesystem::path& folder);

// Computes the SHA-256 of files in parallel, and adds their sizes to `bytes`. Throws InputError if a file
// cannot be read.
std::vector<std::string> HashFiles(const std::filesystem::path& folder, const std::vector<std::string>& files,
                                   uint64_t* bytes);

// Returns the manifest of a folder. The results folders below it must already have manifests. Throws
// InputError.
nlohmann::ordered_json MakeManifest(const std::filesystem::path& folder);

struct ManifestCheck {
  // Deviations from the manifest, one line each, with the file's path.
  std::vector<std::string> findings;
  // Files that are not in the manifest.
  std::vector<std::string> added;
  uint64_t files = 0, bytes = 0;
};
// Compares a folder with its manifest.json, which must exist. Throws InputError if the folder cannot be read.
ManifestCheck CheckManifest(const std::filesystem::path& folder);

}  // namespace evalbus::results
