#include "runner/training_starts.h"

#include <fmt/format.h>

#include <filesystem>
#include <sstream>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "export/hdf5_file.h"
#include "export/training_set.h"
#include "results/run_reader.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Returns a string that is equal for equal starts, because nlohmann::json sorts the keys and writes the
// shortest text that parses to the same number.
std::string StartText(const std::string& task, const ordered_json& parameters) {
  return task + " " + nlohmann::json(parameters).dump();
}

// Returns the strings of the starts of all complete episodes. By default, `evalbus export` exports all of
// these.
std::vector<std::string> StartsOfRuns(const fs::path& folder) {
  std::vector<std::string> starts;
  for (const results::RecordedRun& run : results::ReadRuns(folder).runs) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      if (!episode.complete) continue;
      const ordered_json line = episode.Json();
      if (!line.contains("parameters")) {
        throw InputError(fmt::format(
            "{}:{}: no \"parameters\", so its start is unknown: recorded by an external source or an older "
            "version of evalbus",
            (run.folder / kEpisodesJsonl).string(), episode.line));
      }
      starts.push_back(StartText(run.task_name(), line["parameters"]));
    }
  }
  return starts;
}

std::vector<std::string> LinesOf(const fs::path& file) {
  std::vector<std::string> lines;
  std::istringstream text(ReadInput(file, "starts of a training set"));
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

// Returns the strings of the starts in lines that `evalbus export` wrote.
std::vector<std::string> StartsOfSet(const fs::path& set, const std::vector<std::string>& lines) {
  std::vector<std::string> starts;
  for (size_t i = 0; i < lines.size(); ++i) {
    const auto line = ParseJson<ordered_json>(lines[i], set.string(), static_cast<int>(i) + 1);
    const auto task = line.find("task"), parameters = line.find("parameters");
    if (task == line.end() || !task->is_string() || parameters == line.end() || !parameters->is_object()) {
      throw InputError(fmt::format(
          "{}: the start of episode {} is unknown, because an external source recorded it", set.string(), i));
    }
    starts.push_back(StartText(task->get<std::string>(), *parameters));
  }
  return starts;
}

std::vector<std::string> StartsIn(const fs::path& path) {
  const fs::path lines = path / (std::string(exports::kStarts) + ".jsonl");
  if (fs::is_regular_file(path)) return StartsOfSet(path, exports::ReadHdf5Texts(path, exports::kStarts));
  if (fs::exists(lines)) return StartsOfSet(lines, LinesOf(lines));
  if (fs::exists(path) && !fs::exists(path / kRunJson) && !fs::exists(path / kSuiteJson)) {
    throw InputError(path.string() + ": neither a run, a suite nor a training set of 'evalbus export': no " +
                     kRunJson + ", " + kSuiteJson + " or " + lines.filename().string());
  }
  return StartsOfRuns(path);
}

}  // namespace

TrainingStarts TrainingStarts::Of(const policy::Contract& contract) {
  TrainingStarts training;
  for (const policy::Contract::TrainingSet& set : contract.trained_on) {
    training.sets_.push_back(set.name);
    try {
      const std::vector<std::string> starts = StartsIn(contract.PathOf(set));
      training.starts_.insert(starts.begin(), starts.end());
    } catch (const InputError& error) {
      throw InputError(set.where + ": " + error.what());
    }
  }
  return training;
}

bool TrainingStarts::Contain(const std::string& task, const ordered_json& parameters) const {
  return starts_.contains(StartText(task, parameters));
}

ordered_json TrainingStarts::Json() const {
  std::string all;
  for (const std::string& start : starts_) all += start + "\n";
  return {{"sets", sets_}, {"starts", starts_.size()}, {"starts_sha256", Sha256Text(all)}};
}

}  // namespace evalbus::runner
