#include "results/kept_results.h"

#include "base/json_file.h"
#include "base/run_layout.h"
#include "results/episode_json.h"
#include "results/policy_calls.h"
#include "results/run_reader.h"

namespace evalbus::results {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

KeptResults::KeptResults(const fs::path& recording) {
  std::vector<fs::path> runs = {recording};
  if (fs::exists(recording / kSuiteJson)) {
    runs.clear();
    for (const std::string& name : RunsInSuite(recording)) runs.push_back(recording / name);
  }
  for (const fs::path& run : runs) {
    if (!fs::exists(run / kRunJson)) continue;
    any_ = true;
    for (const RecordedEpisode& episode : ReadRunAsFarAsItGot(run).episodes) {
      lines_[EpisodeLog(run, episode.episode)] = episode.Json();
    }
  }
}

std::string KeptResults::Difference(const fs::path& log, const RescoredEpisode& episode) {
  if (!any_) return "";
  const auto found = lines_.find(log);
  if (found == lines_.end()) return std::string(kEpisodesJsonl) + " has no line for this episode";
  ordered_json line = found->second;
  lines_.erase(found);
  // A log contains neither the pacing nor the information whether the start was part of the training data.
  line.erase("pacing");
  line.erase(metrics::kSeenInTraining);
  const model_info_t& model = *episode.model;
  // Lines of older versions have no parameters.
  const bool has_parameters = line.contains("parameters") && episode.begin;
  ordered_json score =
      EpisodeJson(model.task, model.variation, episode.summary, has_parameters ? &*episode.begin : nullptr);
  if (HasDelayMetrics(line)) {
    const fs::path calls = log.parent_path() / kPolicyCallsJson;
    if (!fs::exists(calls))
      return std::string(kEpisodesJsonl) + " has metrics of a delay, but " + kPolicyCallsJson + " is missing";
    AddDelayMetrics(ReadJsonFile<ordered_json>(calls), episode.summary, &score);
  }
  // The score is written and parsed again, because text that is not valid UTF-8 changes when it is written.
  const auto differences = Differences(line, ordered_json::parse(ToText(score)));
  return differences.empty() ? "" : std::string(kEpisodesJsonl) + " differs: " + DifferencesText(differences);
}

std::vector<fs::path> KeptResults::Missing() const {
  std::vector<fs::path> missing;
  for (const auto& [log, line] : lines_) missing.push_back(log);
  return missing;
}

}  // namespace evalbus::results
