#include "cli/results/run_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <optional>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/random.h"
#include "base/run_layout.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

[[noreturn]] void Fail(const std::string& where, const std::string& what) {
  throw InputError(where + ": " + what);
}

std::string ReadFile(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || fs::is_directory(file)) Fail(file.string(), "cannot be read");
  return {std::istreambuf_iterator<char>(stream), {}};
}

ordered_json ParseObject(const std::string& text, const std::string& where) {
  ordered_json json;
  try {
    json = ordered_json::parse(text);
  } catch (const nlohmann::json::exception&) {  // of a number too large, too
    Fail(where, "not JSON");
  }
  if (!json.is_object()) Fail(where, "not a JSON object");
  return json;
}

// A member of a type; `expected` names it in the error.
template <class T>
T Get(const ordered_json& json, const char* key, const char* expected, const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end()) Fail(where, fmt::format("no \"{}\"; is this of evalbus?", key));
  const bool good = std::is_same_v<T, std::string>    ? found->is_string()
                    : std::is_same_v<T, bool>         ? found->is_boolean()
                    : std::is_same_v<T, ordered_json> ? found->is_object()
                                                      : found->is_number_integer();
  if (!good) Fail(where, fmt::format("\"{}\" is {}, expected {}", key, found->dump(), expected));
  return found->get<T>();
}

RecordedEpisode ReadEpisode(const std::string& text, const std::string& where, const RecordedRun& run) {
  RecordedEpisode episode;
  const ordered_json json = ParseObject(text, where);
  const auto task = Get<std::string>(json, "task", "a name", where);
  const auto variation = Get<std::string>(json, "variation", "a name", where);
  if (task != run.task || variation != run.variation) {
    Fail(where, fmt::format("an episode of {}/{} in a run of {}: runs must not be mixed in one file", task,
                            variation, run.task_name()));
  }
  const auto number = Get<int64_t>(json, "episode", "a number", where);
  if (number < 0 || number > 99'999'999) {
    Fail(where, fmt::format("\"episode\" is {}, expected a number from 0", number));
  }
  episode.episode = static_cast<int>(number);
  episode.seed = Get<int64_t>(json, "seed", "a whole number", where);
  if (episode.seed != EpisodeSeed(run.seed, episode.episode)) {
    Fail(where, fmt::format("seed {} is not that of episode {} in a run with seed {}: a line of another run",
                            episode.seed, number, run.seed));
  }
  episode.end_reason = Get<std::string>(json, "end_reason", "a name", where);
  episode.failure_reason = Get<std::string>(json, "failure_reason", "a name, empty on success", where);
  episode.complete = Get<bool>(json, "complete", "true or false", where);
  const auto metrics = Get<ordered_json>(json, "metrics", "an object", where);
  Get<ordered_json>(json, "extended", "an object", where);
  const auto success = metrics.find("success");
  if (success == metrics.end() || (*success != 0 && *success != 1)) {
    Fail(where, "\"metrics\" without a \"success\" of 0 or 1");
  }
  episode.success = *success == 1;
  episode.json = json;
  return episode;
}

std::vector<RecordedEpisode> ReadEpisodes(const fs::path& file, const RecordedRun& run) {
  std::vector<RecordedEpisode> episodes;
  const std::string text = ReadFile(file);
  std::map<int, int> line_of;
  int line = 0;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string where = fmt::format("{}:{}", file.string(), ++line);
    const std::string content = text.substr(begin, end - begin);
    if (end == text.size() && !ordered_json::accept(content)) {
      Fail(where, "cut off in mid-line: the run was stopped while this was written; remove the line");
    }
    RecordedEpisode episode = ReadEpisode(content, where, run);
    const auto [first, is_new] = line_of.emplace(episode.episode, line);
    if (!is_new)
      Fail(where, fmt::format("episode {} again, first in line {}", episode.episode, first->second));
    episode.line = line;
    episodes.push_back(std::move(episode));
    begin = end + 1;
  }
  std::sort(episodes.begin(), episodes.end(),
            [](const auto& a, const auto& b) { return a.episode < b.episode; });
  return episodes;
}

std::vector<int> UnfinishedEpisodes(const fs::path& folder) {
  std::vector<int> unfinished;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder / "episodes", none)) {
    const std::string stem = entry.path().stem().string();
    int episode = -1;
    const auto parsed = std::from_chars(stem.data(), stem.data() + stem.size(), episode);
    if (entry.path().extension() == kUnfinishedEnding && parsed.ptr == stem.data() + stem.size())
      unfinished.push_back(episode);
  }
  std::sort(unfinished.begin(), unfinished.end());
  return unfinished;
}

// "3", "3 and 7", "3, 7 and 9", "3, 7, 9 and 12 more".
std::string List(const std::vector<int>& numbers) {
  constexpr size_t kShown = 8;
  std::string text;
  for (size_t i = 0; i < std::min(numbers.size(), kShown); ++i) {
    const bool last = i + 1 == numbers.size();
    text += fmt::format("{}{}", i == 0 ? "" : last ? " and " : ", ", numbers[i]);
  }
  return numbers.size() > kShown ? text + fmt::format(" and {} more", numbers.size() - kShown) : text;
}

std::string Plural(size_t n) { return n == 1 ? "episode" : "episodes"; }

std::string FolderName(const fs::path& folder) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

// What run.json says, without the episodes.
RecordedRun ReadInfo(const fs::path& folder) {
  const fs::path file = folder / kRunJson;
  RecordedRun run;
  run.folder = folder;
  run.name = FolderName(folder);
  ReadJsonFile(file);  // says in which line it is no JSON
  run.info = ParseObject(ReadFile(file), file.string());
  run.task = Get<std::string>(run.info, "task", "a name", file.string());
  run.variation = Get<std::string>(run.info, "variation", "a name", file.string());
  run.policy = Get<std::string>(run.info, "policy", "a name", file.string());
  run.seed = Get<int64_t>(run.info, "seed", "a whole number", file.string());
  run.planned = static_cast<int>(Get<int64_t>(run.info, "episodes", "a number", file.string()));
  return run;
}

// Nothing where no episode has finished yet.
std::optional<RecordedRun> ReadIfBegun(const fs::path& folder) {
  RecordedRun run = ReadInfo(folder);
  if (fs::exists(folder / kEpisodesJsonl)) run.episodes = ReadEpisodes(folder / kEpisodesJsonl, run);
  if (run.episodes.empty()) return std::nullopt;
  run.unfinished = UnfinishedEpisodes(folder);
  return run;
}

void CheckFolder(const fs::path& folder) {
  if (!fs::exists(folder)) Fail(folder.string(), "no such run folder");
  if (!fs::is_directory(folder)) Fail(folder.string(), "a file; expected a run folder");
}

}  // namespace

std::vector<std::pair<std::string, double>> RecordedEpisode::Values() const {
  auto values = metrics::FlattenedValues(json.at("metrics"));
  for (const auto& [name, value] : metrics::FlattenedValues(json.at("extended")))
    values.emplace_back("extended." + name, value);
  return values;
}

std::vector<int> RecordedRun::incomplete() const {
  std::vector<int> numbers;
  for (const RecordedEpisode& episode : episodes) {
    if (!episode.complete) numbers.push_back(episode.episode);
  }
  return numbers;
}

metrics::RunStatistics RecordedRun::Statistics() const {
  metrics::RunStatistics statistics;
  for (const RecordedEpisode& recorded : episodes) {
    statistics.Add(recorded.episode, metrics::ResultOf(recorded.json));
  }
  return statistics;
}

std::vector<std::string> RecordedRun::Remarks() const {
  std::vector<std::string> remarks;
  const size_t finished = episodes.size();
  if (static_cast<int>(finished) < planned) {
    remarks.push_back(fmt::format("{} of {} episodes have finished", finished, planned));
  }
  if (!unfinished.empty()) {
    remarks.push_back(
        fmt::format("begun and not finished: {} {}", Plural(unfinished.size()), List(unfinished)));
  }
  if (const std::vector<int> numbers = incomplete(); !numbers.empty()) {
    remarks.push_back(
        fmt::format("left out of all rates, since ticks are missing or samples were refused: {} {}",
                    Plural(numbers.size()), List(numbers)));
  }
  const std::string samples = Statistics().Summary(false).SamplesText();
  if (!samples.empty()) remarks.push_back(samples);
  return remarks;
}

RecordedRun ReadRun(const fs::path& folder) {
  CheckFolder(folder);
  if (!fs::exists(folder / kRunJson)) {
    Fail(folder.string(), fs::exists(folder / kSuiteJson)
                              ? "a suite; expected one of the runs in it"
                              : "not a run folder of evalbus, it has no run.json");
  }
  std::optional<RecordedRun> run = ReadIfBegun(folder);
  if (!run) Fail(folder.string(), "this run has no finished episode");
  return *run;
}

RecordedRuns ReadRuns(const fs::path& folder) {
  CheckFolder(folder);
  RecordedRuns result{
      .folder = folder, .name = FolderName(folder), .is_suite = false, .runs = {}, .missing = {}};
  const fs::path suite = folder / kSuiteJson;
  if (!fs::exists(suite)) {
    result.runs.push_back(ReadRun(folder));
    return result;
  }
  result.is_suite = true;
  const nlohmann::json json = ReadJsonFile(suite);
  if (!json.is_object() || !json.contains("runs") || !json["runs"].is_array()) {
    Fail(suite.string(), "no \"runs\", expected a list of folders in this one");
  }
  for (const nlohmann::json& entry : json["runs"]) {
    const auto name = entry.is_string() ? entry.get<std::string>() : "";
    if (name.empty() || name == "." || name == ".." || name.find_first_of("/\\") != std::string::npos) {
      Fail(suite.string(), entry.dump() + " in \"runs\", expected the name of a folder in this one");
    }
    std::optional<RecordedRun> run;
    if (fs::exists(folder / name / kRunJson)) run = ReadIfBegun(folder / name);
    if (run) {
      run->name = result.name + "/" + name;
      result.runs.push_back(std::move(*run));
    } else {
      result.missing.push_back(name);
    }
  }
  if (result.runs.empty()) Fail(folder.string(), "this suite has no finished episode");
  return result;
}

}  // namespace evalbus::results
