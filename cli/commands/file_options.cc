#include "cli/commands/file_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "base/plan_layout.h"
#include "base/run_layout.h"
#include "plans/certify.h"
#include "plans/plan_folder.h"
#include "results/manifest.h"
#include "results/no_return.h"
#include "results/notes.h"
#include "results/verdicts.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFiles[] = {kRunJson,
                                       kSuiteJson,
                                       kPlanJson,
                                       kEpisodesJsonl,
                                       kSummaryJson,
                                       kCollectJson,
                                       plans::kStopsJson,
                                       plans::kCertificateJson,
                                       results::kManifestJson,
                                       results::kNoReturnJson,
                                       results::kNotesJson,
                                       results::kVerdictsJsonl};
constexpr std::string_view kFolders[] = {kEpisodesFolder, kModelFolder, kLogsFolder, kPartsFolder};

bool HasResults(const fs::path& folder) {
  std::error_code none;
  return std::ranges::any_of(std::array{kRunJson, kSuiteJson, kPlanJson, plans::kCertificateJson},
                             [&](const char* name) { return fs::exists(folder / name, none); });
}

}  // namespace

std::string CheckOutputFile(const std::string& name) {
  std::error_code none;
  const fs::path file = fs::weakly_canonical(name, none);
  if (!fs::exists(file, none)) return "";
  for (fs::path folder = file.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    if (!HasResults(folder)) continue;
    const fs::path relative = file.lexically_relative(folder), first = *relative.begin();
    const bool is_own = first == relative ? std::ranges::find(kFiles, first.native()) != std::end(kFiles)
                                          : std::ranges::find(kFolders, first.native()) != std::end(kFolders);
    if (is_own) return name + ": a file of the results in " + folder.string() + "; choose another name";
  }
  return "";
}

void AddVideoTiming(CLI::App* app, viz::VideoTiming* timing) {
  app->add_option(
      "--highlight", timing->highlight_s,
      fmt::format("seconds around the decisive moment (docs/failures.md) that are shown at --speed; the rest "
                  "is {} times faster",
                  viz::kFastForward));
  app->add_option("--speed", timing->speed, "simulated seconds per second of video")->capture_default_str();
  app->add_option_function<std::string>(
      "--trim", [timing](const std::string& text) { viz::ParseTrim(text, timing); },
      "FROM..TO: only this part of the episode, in seconds; without FROM from its start, without TO to its "
      "end");
}

}  // namespace evalbus::commands
