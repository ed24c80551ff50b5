#include "results/run_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/plan_layout.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/source.h"
#include "results/found_runs.h"
#include "results/notes.h"
#include "results/pacing.h"
#include "results/run_folder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

[[noreturn]] void Fail(const std::string& where, const std::string& what) {
  throw InputError(where + ": " + what);
}

// Returns a member of the given type, objects by reference. `expected` describes the type in the error.
template <class T>
std::conditional_t<std::is_same_v<T, ordered_json>, const ordered_json&, T> Get(const ordered_json& json,
                                                                                const char* key,
                                                                                const char* expected,
                                                                                const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end()) Fail(where, fmt::format("no \"{}\"; was this made by evalbus?", key));
  const bool good = std::is_same_v<T, std::string>    ? found->is_string()
                    : std::is_same_v<T, bool>         ? found->is_boolean()
                    : std::is_same_v<T, ordered_json> ? found->is_object()
                    : std::is_same_v<T, double>       ? found->is_number()
                                                      : found->is_number_integer();
  if (!good) Fail(where, fmt::format("\"{}\" is {}, expected {}", key, ToText(*found), expected));
  if constexpr (std::is_same_v<T, ordered_json>) {
    return *found;
  } else {
    return found->get<T>();
  }
}

// Checks the pacing of a real-time episode, which is null if its EPISODE_END was lost.
void CheckPacing(const ordered_json& json, const std::string& where) {
  const auto pacing = json.find("pacing");
  if (pacing == json.end() || pacing->is_null()) return;
  if (!pacing->is_object()) Fail(where, fmt::format("\"pacing\" is {}, expected an object", ToText(*pacing)));
  for (const char* count : {"ticks", "deadline_misses", "late_ticks"}) {
    Get<int64_t>(*pacing, count, "a whole number", where);
  }
  for (const PacingTimes& times : kPacingTimes) {
    const auto& distribution = Get<ordered_json>(*pacing, times.key, "an object", where);
    Get<int64_t>(distribution, "count", "a whole number", where);
    for (const char* time : {"p50_s", "p99_s", "p999_s", "max_s"})
      Get<double>(distribution, time, "a number", where);
  }
}

void ReadEpisodes(RecordedRun* run) {
  const fs::path file = run->folder / kEpisodesJsonl;
  std::istringstream stream(ReadInput(file));
  std::map<int, int> line_of;
  int line = 0;
  for (std::string text; std::getline(stream, text);) {
    const std::string where = fmt::format("{}:{}", file.string(), ++line);
    ordered_json json;
    try {
      json = ParseJson<ordered_json>(text, file.string(), line);
    } catch (const InputError&) {
      if (!stream.eof()) throw;
      // The run was killed, or its disk was full, while this line was being written.
      run->cut_line = line;
      break;
    }
    RecordedEpisode episode = ReadEpisode(json, where, *run);
    episode.text = text;
    const auto [first, is_new] = line_of.emplace(episode.episode, line);
    if (!is_new)
      Fail(where, fmt::format("episode {} is repeated, first in line {}", episode.episode, first->second));
    episode.line = line;
    run->episodes.push_back(std::move(episode));
  }
  std::sort(run->episodes.begin(), run->episodes.end(),
            [](const auto& a, const auto& b) { return a.episode < b.episode; });
}

std::vector<int> UnfinishedEpisodes(const fs::path& folder) {
  std::vector<int> unfinished;
  for (const fs::path& episode : EpisodeFolders(folder)) {
    if (IsUnfinished(episode)) unfinished.push_back(*EpisodeOfFolder(episode));
  }
  std::sort(unfinished.begin(), unfinished.end());
  return unfinished;
}

// Lists numbers, for example "3", "3 and 7" or "3, 7 and 9". After eight numbers, only adds the count of the
// remaining numbers, such as "and 12 more".
std::string List(const std::vector<int>& numbers) {
  constexpr size_t kShown = 8;
  std::string text;
  for (size_t i = 0; i < std::min(numbers.size(), kShown); ++i) {
    const bool last = i + 1 == numbers.size();
    text += fmt::format("{}{}", i == 0 ? "" : last ? " and " : ", ", numbers[i]);
  }
  return numbers.size() > kShown ? text + fmt::format(" and {} more", numbers.size() - kShown) : text;
}

std::string Episodes(size_t n) { return n == 1 ? "episode" : "episodes"; }

}  // namespace

void CheckRunFolder(const fs::path& folder) {
  if (!fs::exists(folder)) Fail(folder.string(), "no such run folder" + SimilarFolder(folder));
  if (!fs::is_directory(folder)) Fail(folder.string(), "a file; expected a run folder");
}

RecordedEpisode ReadEpisode(const ordered_json& json, const std::string& where, const RecordedRun& run) {
  RecordedEpisode episode;
  if (!json.is_object()) Fail(where, "not a JSON object");
  const auto task = Get<std::string>(json, "task", "a name", where);
  const auto variation = Get<std::string>(json, "variation", "a name", where);
  if (task != run.task || variation != run.variation) {
    Fail(where, fmt::format("an episode of {}/{} in a run of {}: runs must not be mixed in one file", task,
                            variation, run.task_name()));
  }
  const auto number = Get<int64_t>(json, "episode", "a number", where);
  if (number < 0 || number > kMaxEpisode) {
    Fail(where, fmt::format("\"episode\" is {}, expected 0 to {}", number, kMaxEpisode));
  }
  episode.episode = static_cast<int>(number);
  episode.seed = Get<int64_t>(json, "seed", "a whole number", where);
  if (episode.seed != run.seeds().OfEpisode(episode.episode)) {
    Fail(where,
         fmt::format(
             "seed {} is not the seed of episode {} in a run with seed {}: the line belongs to another run",
             episode.seed, number, run.seed));
  }
  episode.end_reason = Get<std::string>(json, "end_reason", "a name", where);
  episode.failure_reason = Get<std::string>(json, "failure_reason", "a name, empty on success", where);
  episode.complete = Get<bool>(json, "complete", "true or false", where);
  if (episode.end_reason == end_reason::kServerError && episode.complete) {
    Fail(where, fmt::format("\"complete\" with \"end_reason\" {}: such an episode cannot be complete",
                            episode.end_reason));
  }
  const ordered_json& metrics = Get<ordered_json>(json, "metrics", "an object", where);
  Get<ordered_json>(json, "extended", "an object", where);
  // Lines of older versions have no parameters.
  if (json.contains("parameters")) {
    for (const auto& [name, value] : Get<ordered_json>(json, "parameters", "an object", where).items()) {
      if (!value.is_number())
        Fail(where,
             fmt::format("\"parameters\": {} is {}, expected a number", Printable(name), ToText(value)));
    }
  }
  const auto success = metrics.find("success");
  const bool is_judged = success != metrics.end();
  if (is_judged != episode.judged() || (is_judged && *success != 0 && *success != 1)) {
    Fail(where, is_judged && !episode.judged() ? "\"success\" of an episode that was not judged"
                                               : "\"metrics\" without a \"success\" of 0 or 1");
  }
  Get<std::string>(json, "end_detail", "a string", where);
  episode.completion_time = Get<double>(metrics, "completion_time", "a number", where);
  episode.explanation =
      Get<std::string>(Get<ordered_json>(json, "explanation", "an object", where), "text", "a string", where);
  if (json.contains("cause")) {
    const ordered_json& cause = Get<ordered_json>(json, "cause", "an object", where);
    episode.cause = {.kind = Get<std::string>(cause, "kind", "a name", where),
                     .time_s = Get<double>(cause, "time_s", "a number", where),
                     .text = Get<std::string>(cause, "text", "a string", where)};
  }
  if (json.contains("final_poses")) Get<ordered_json>(json, "final_poses", "an object", where);
  CheckPacing(json, where);
  if (json.contains(metrics::kSeenInTraining))
    Get<bool>(json, metrics::kSeenInTraining, "true or false", where);
  try {
    static_cast<metrics::EpisodeResult&>(episode) = metrics::ResultOf(json);
  } catch (const nlohmann::json::exception&) {
    Fail(where, "stages, slips, collisions or final poses are not numbers");
  } catch (const InputError& error) {
    Fail(where, error.what());
  }
  return episode;
}

metrics::NamedNumbers RecordedEpisode::Values() const {
  const ordered_json json = Json();
  metrics::NamedNumbers values = metrics::FlattenedValues(json.at("metrics"));
  const metrics::NamedNumbers extended = metrics::FlattenedValues(json.at("extended"), "extended");
  values.insert(values.end(), extended.begin(), extended.end());
  return values;
}

const char* RecordedRun::clock() const {
  const auto is = [&](const char* key, const auto& value) {
    const auto found = info.find(key);
    return found != info.end() && *found == value;
  };
  if (is("watch", true) || is("source", source_name::kFile)) return clock_name::kSource;
  return is("realtime", true) ? clock_name::kRealtime : clock_name::kLockstep;
}

bool RecordedRun::is_simulated() const {
  return !info.value("watch", false) && info.value("source", source_name::kSim) == source_name::kSim;
}

std::string RecordedRun::engine() const {
  return is_simulated() ? info.value("mujoco_version", std::string()) : "";
}

std::vector<int> RecordedRun::incomplete() const {
  std::vector<int> numbers;
  for (const RecordedEpisode& episode : episodes) {
    if (!episode.complete && !episode.invalid) numbers.push_back(episode.episode);
  }
  return numbers;
}

bool RecordedRun::IsPlanned(int episode) const {
  if (episode >= planned) return false;
  if (!is_part()) return true;
  const ordered_json& only = info.at("only");
  return std::find(only.begin(), only.end(), episode) != only.end();
}

bool RecordedRun::is_part() const {
  const auto only = info.find("only");
  return only != info.end() && only->is_array() && !only->empty();
}

int RecordedRun::num_planned() const {
  return is_part() ? static_cast<int>(info.at("only").size()) : planned;
}

std::vector<int> RecordedRun::invalid() const {
  std::vector<int> numbers;
  for (const RecordedEpisode& episode : episodes) {
    // An episode remains in this list if an operator's verdict has replaced the automatic one.
    if (episode.end_reason == end_reason::kServerError) numbers.push_back(episode.episode);
  }
  return numbers;
}

metrics::RunStatistics RecordedRun::Statistics() const {
  metrics::RunStatistics statistics;
  for (const RecordedEpisode& recorded : episodes) {
    statistics.Add(recorded.episode, recorded);
  }
  return statistics;
}

bool RecordedRun::is_collection() const { return std::filesystem::exists(folder / kCollectJson); }

bool RecordedRun::may_end_early() const {
  const auto until = info.find("until"), watch = info.find("watch");
  return (until != info.end() && *until != "") || (watch != info.end() && *watch == true);
}

std::vector<std::string> RecordedRun::Remarks() const {
  std::vector<std::string> remarks;
  const size_t finished = episodes.size();
  const auto total = static_cast<size_t>(num_planned());
  if (finished < total && !is_collection())
    remarks.push_back(fmt::format("{} of {} episodes have finished", finished, total));
  if (!unfinished.empty()) {
    remarks.push_back(
        fmt::format("started but not finished: {} {}", Episodes(unfinished.size()), List(unfinished)));
  }
  if (const std::vector<int> numbers = invalid(); !numbers.empty()) {
    remarks.push_back(
        fmt::format("invalid and excluded from all rates because the policy's server failed: {} {}; --resume "
                    "runs {} again",
                    Episodes(numbers.size()), List(numbers), numbers.size() == 1 ? "it" : "them"));
  }
  if (const std::vector<int> numbers = incomplete(); !numbers.empty()) {
    remarks.push_back(
        fmt::format("excluded from all rates because they are incomplete (aborted, or with missing ticks or "
                    "refused samples): {} {}",
                    Episodes(numbers.size()), List(numbers)));
  }
  if (cut_line > 0) {
    remarks.push_back(
        fmt::format("line {} of {} is truncated and ignored: the run was stopped while it was written",
                    cut_line, kEpisodesJsonl));
  }
  if (is_collection()) {
    remarks.emplace_back(
        "collected demonstrations: only successes were kept, so its rates do not describe the policy");
  }
  for (const std::string& note : Statistics().Summary(false).Notes()) remarks.push_back(note);
  return remarks;
}

std::string SeedStreamOf(const ordered_json& info, const std::string& file) {
  if (!info.contains("seed_stream")) return kSharedSeeds;
  const auto stream = Get<std::string>(info, "seed_stream", "a name", file);
  if (IsSeedStream(stream)) return stream;
  Fail(file,
       fmt::format("\"seed_stream\" is \"{}\", which this version of evalbus does not support", stream));
}

RecordedRun ReadRunInfo(const fs::path& folder) {
  const fs::path file = folder / kRunJson;
  RecordedRun run;
  run.folder = folder;
  run.name = Printable(NameOfRun(folder));
  run.info = ReadJsonFile<ordered_json>(file);
  if (!run.info.is_object()) Fail(file.string(), "not a JSON object");
  // Runs of older versions have no schema_version.
  if (const auto version = run.info.value("schema_version", ordered_json(kRunSchemaVersion));
      version != kRunSchemaVersion) {
    Fail(file.string(),
         fmt::format("\"schema_version\" is {}, expected {}; read this run with evalbus {}", ToText(version),
                     kRunSchemaVersion, ToText(run.info.value("evalbus_version", ordered_json()))));
  }
  run.task = Get<std::string>(run.info, "task", "a name", file.string());
  run.variation = Get<std::string>(run.info, "variation", "a name", file.string());
  run.policy = Get<std::string>(run.info, "policy", "a name", file.string());
  // Runs of older versions have no policy_name.
  if (run.info.contains("policy_name")) {
    const auto name = Get<std::string>(run.info, "policy_name", "a name", file.string());
    if (!name.empty()) run.policy = name;
  }
  run.seed = Get<int64_t>(run.info, "seed", "a whole number", file.string());
  run.seed_stream = SeedStreamOf(run.info, file.string());
  const auto planned = Get<int64_t>(run.info, "episodes", "a number", file.string());
  if (planned < 0 || planned > kMaxEpisode) {
    Fail(file.string(), fmt::format("\"episodes\" is {}, expected 0 to {}", planned, kMaxEpisode));
  }
  run.planned = static_cast<int>(planned);
  return run;
}

RecordedRun ReadRun(const fs::path& folder) {
  CheckRunFolder(folder);
  if (!fs::exists(folder / kRunJson)) {
    Fail(folder.string(), fs::exists(folder / kSuiteJson) ? "a suite; expected one of the runs in it"
                          : fs::exists(folder / kPlanJson)
                              ? PlanNotExpected(folder, false)
                              : "not a run folder of evalbus: it has no run.json");
  }
  RecordedRun run = ReadRunAsFarAsItGot(folder);
  if (run.episodes.empty()) Fail(folder.string(), "this run has no finished episode");
  return run;
}

RecordedRun ReadRunAsFarAsItGot(const fs::path& folder) {
  RecordedRun run = ReadRunInfo(folder);
  if (fs::exists(folder / kEpisodesJsonl)) ReadEpisodes(&run);
  Notes notes = ReadNotes(folder);
  for (RecordedEpisode& episode : run.episodes) {
    if (auto note = notes.find(episode.episode); note != notes.end()) episode.note = std::move(note->second);
  }
  run.unfinished = UnfinishedEpisodes(folder);
  return run;
}

std::vector<std::string> RunsInSuite(const fs::path& folder) {
  const fs::path file = folder / kSuiteJson;
  const auto json = ReadJsonFile(file);
  if (!json.is_object() || !json.contains("runs") || !json["runs"].is_array()) {
    Fail(file.string(), "no \"runs\", expected a list of folders in the suite");
  }
  std::vector<std::string> names;
  for (const auto& entry : json["runs"]) {
    const auto name = entry.is_string() ? entry.get<std::string>() : "";
    if (name.empty() || name == "." || name == ".." || name.find_first_of("/\\") != std::string::npos) {
      Fail(file.string(), ToText(entry) + " in \"runs\", expected the name of a folder in the suite");
    }
    if (std::ranges::find(names, name) != names.end()) {
      Fail(file.string(), ToText(entry) + " is listed in \"runs\" twice");
    }
    names.push_back(name);
  }
  return names;
}

RecordedRuns ReadRuns(const fs::path& folder) {
  CheckRunFolder(folder);
  RecordedRuns result{
      .folder = folder, .name = Printable(NameOfRun(folder)), .is_suite = false, .runs = {}, .missing = {}};
  if (!fs::exists(folder / kSuiteJson)) {
    if (fs::exists(folder / kPlanJson) && !fs::exists(folder / kRunJson))
      Fail(folder.string(), PlanNotExpected(folder, true));
    result.runs.push_back(ReadRun(folder));
    return result;
  }
  result.is_suite = true;
  for (const std::string& name : RunsInSuite(folder)) {
    RecordedRun run;
    if (fs::exists(folder / name / kRunJson)) run = ReadRunAsFarAsItGot(folder / name);
    if (run.episodes.empty()) {
      result.missing.push_back(name);
      continue;
    }
    run.name = result.name + "/" + name;
    result.runs.push_back(std::move(run));
  }
  if (result.runs.empty()) Fail(folder.string(), "this suite has no finished episode");
  return result;
}

}  // namespace evalbus::results
