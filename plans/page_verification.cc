#include "plans/page_verification.h"

#include <fmt/format.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "plans/plan_report.h"
#include "report/comparison_report.h"
#include "report/page/page_check.h"
#include "report/run_report.h"
#include "results/compared_runs.h"
#include "results/comparison_json.h"
#include "results/manifest.h"
#include "results/rescorer.h"
#include "runner/run_json.h"
#include "runner/version.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Reads the runs of a comparison, the baseline first.
std::vector<results::RecordedRuns> ReadCompared(
    const std::vector<std::pair<fs::path, std::string>>& folders) {
  std::vector<results::RecordedRuns> runs;
  for (const auto& [folder, name] : folders) {
    runs.push_back(results::ReadForComparison(folder));
    // The original names are kept, because ReadRuns() derives names from the folders, which may have moved.
    runs.back().name = name;
  }
  return runs;
}

// stored: JSON of `evalbus compare`, with the chosen metrics in "on".
std::vector<results::Comparison> CompareWithFirst(const std::vector<results::RecordedRuns>& runs,
                                                  const ordered_json& stored) {
  return results::CompareAll({runs.begin() + 1, runs.end()}, runs.front(),
                             stored.value("on", std::vector<std::string>()));
}

// Finds a results folder whose path is relative to the folder in which `evalbus compare` ran. Tries the
// folders above the file, then the working folder. Empty if there is no such folder.
fs::path FindFolder(const fs::path& folder, const fs::path& file) {
  const fs::path start = fs::absolute(file).lexically_normal().parent_path();
  for (fs::path above = start;; above = above.parent_path()) {
    if (results::IsResultsFolder(above / folder)) return above / folder;
    if (above == above.parent_path()) break;
  }
  return results::IsResultsFolder(folder) ? folder : fs::path();
}

class Verifier {
 public:
  explicit Verifier(results::Verification* result) : result_(*result) {}

  void Check(const fs::path& folder) {
    const results::FolderContents contents = results::ContentsOf(folder);
    for (const std::string& file : contents.files) {
      if (file.starts_with(std::string(kEpisodesFolder) + "/")) continue;
      const fs::path path = folder / file;
      try {
        if (path.extension() == ".html") CheckPage(path);
        if (path.extension() == ".json") CheckComparison(path);
      } catch (const InputError& error) {
        AddFinding(path.string() + ": cannot be regenerated: " + error.what());
      }
    }
    for (const std::string& below : contents.folders) Check(folder / below);
  }

 private:
  void AddFinding(const std::string& finding) { result_.findings.push_back(finding); }
  void AddNote(const fs::path& file, const std::string& note) {
    result_.notes.push_back(file.string() + ": " + note);
  }

  void CheckPage(const fs::path& file) {
    const std::string html = ReadInput(file);
    if (html.find(report::kMadeBy) == std::string::npos) return;  // not ours
    const report::PageContent stored = report::ReadPage(html, file.string());
    if (stored.made_by.empty()) return;
    // Other versions of evalbus may generate different pages.
    if (!stored.made_by.starts_with(fmt::format("{} ({}", kVersion, kGitCommit))) {
      AddNote(file, "not compared: made by evalbus " + stored.made_by);
      return;
    }
    if (stored.source.is_null()) {
      AddNote(file, "not compared: the page does not name the results that it was made from");
      return;
    }
    const std::string computed = Make(file, stored);
    ++result_.pages;
    if (const auto difference = report::FirstDifference(stored, report::ReadPage(computed, file.string())))
      AddFinding(file.string() + ": " + *difference);
  }

  // Generates a page again, without images and 3D viewer.
  std::string Make(const fs::path& file, const report::PageContent& stored) {
    const ordered_json& source = stored.source;
    const fs::path beside = file.parent_path();
    try {
      const std::string page = source.at("page");
      const auto compared = [&](const ordered_json& run) {
        return std::pair(beside / run.at("folder").get<std::string>(), run.at("name").get<std::string>());
      };
      if (page == report::kReportPage) {
        results::RecordedRuns runs =
            results::ReadRuns((beside / source.at("folder").get<std::string>()).lexically_normal());
        Rename(source.at("name"), &runs);
        return report::RunReport(std::move(runs), file, source.at("episodes"), stored.made_by, 0,
                                 runner::CommandOf)
            .html;
      }
      if (page == report::kComparisonPage) {
        std::vector<std::pair<fs::path, std::string>> folders = {compared(source.at("baseline"))};
        for (const ordered_json& run : source.at("runs")) folders.push_back(compared(run));
        return report::ComparisonReport(CompareWithFirst(ReadCompared(folders), source), file, stored.made_by,
                                        0, source)
            .html;
      }
      const fs::path plan =
          page == report::kPlanPage ? beside : beside / source.at("folder").get<std::string>();
      return PagesOfPlan(fs::canonical(plan)).at(fs::canonical(file));
    } catch (const ordered_json::exception& error) {
      throw InputError(std::string("its source is not valid: ") + error.what());
    } catch (const std::out_of_range&) {
      throw InputError("its plan has no such page");
    } catch (const fs::filesystem_error& error) {
      throw InputError(error.what());
    }
  }

  // Gives the runs the name that they had when the page was generated, because folders may have been renamed.
  static void Rename(const std::string& name, results::RecordedRuns* runs) {
    for (results::RecordedRun& run : runs->runs) {
      const bool is_in_suite = run.name.starts_with(runs->name + "/");
      run.name = name + (is_in_suite ? run.name.substr(runs->name.size()) : "");
    }
    runs->name = name;
  }

  const std::map<fs::path, std::string>& PagesOfPlan(const fs::path& plan) {
    auto known = plans_.find(plan);
    if (known == plans_.end()) {
      const PlanFolder folder(plan);
      known = plans_.emplace(plan, PlanPages(folder, ReadPlanResults(folder), 0)).first;
    }
    return known->second;
  }

  void CheckComparison(const fs::path& file) {
    ordered_json stored;
    try {
      stored = ReadJsonFile<ordered_json>(file);
    } catch (const InputError& error) {
      result_.notes.push_back(error.what());
      return;
    }
    if (!stored.is_object() || !stored.contains("baseline") || !stored.contains("comparisons") ||
        !stored["baseline"].is_object() || !stored["comparisons"].is_array())
      return;
    std::vector<std::pair<fs::path, std::string>> folders;
    std::vector<std::string> as_given;
    try {
      const auto add = [&](const ordered_json& run) {
        as_given.push_back(run.at("folder"));
        folders.emplace_back(FindFolder(as_given.back(), file), run.at("name"));
      };
      add(stored.at("baseline"));
      for (const ordered_json& run : stored.at("comparisons")) add(run);
    } catch (const ordered_json::exception&) {
      return;  // not a file of `evalbus compare --json`
    }
    for (size_t i = 0; i < folders.size(); ++i) {
      if (!folders[i].first.empty()) continue;
      AddNote(file, "not compared: there is no run " + as_given[i]);
      return;
    }
    const std::vector<results::RecordedRuns> runs = ReadCompared(folders);
    std::vector<const results::RecordedRuns*> all;
    for (const results::RecordedRuns& run : runs) all.push_back(&run);
    ordered_json computed = ordered_json::parse(
        ToText(results::ComparisonJson(CompareWithFirst(runs, stored), results::RankBySuccess(all))));
    computed["baseline"]["folder"] = as_given[0];
    for (size_t i = 1; i < as_given.size(); ++i) computed["comparisons"][i - 1]["folder"] = as_given[i];
    ++result_.comparisons;
    const std::vector<results::Difference> differences = results::Differences(stored, computed);
    if (differences.empty()) return;
    const results::Difference& first = differences.front();
    AddFinding(
        fmt::format("{}: {} is {}, recomputed {}{}", file.string(), first.name, first.before, first.after,
                    differences.size() == 1 ? "" : fmt::format(" ({} values differ)", differences.size())));
  }

  results::Verification& result_;
  std::map<fs::path, std::map<fs::path, std::string>> plans_;
};

}  // namespace

void VerifyPages(const fs::path& folder, results::Verification* result) { Verifier(result).Check(folder); }

}  // namespace evalbus::plans
