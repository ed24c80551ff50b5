// Reads the folders of runs and suites back (docs/run_folder.md). Strict: a line that does not belong is an
// error that names file and line, never left out silently.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "lcmtypes/end_reason.h"
#include "metrics/statistics/run_statistics.h"

namespace evalbus::results {

// A line of episodes.jsonl.
struct RecordedEpisode {
  int episode = 0;
  int64_t seed = 0;
  std::string end_reason;
  std::string failure_reason;
  // False where ticks are missing, samples were refused or it is invalid: left out of every rate.
  bool complete = false;
  // The policy's server failed, which says nothing of the policy: --resume runs it again.
  bool invalid() const { return end_reason == end_reason::kServerError; }
  // False where the source did not know what success or failure asks for: it has no success, and is in no
  // rate.
  bool judged() const { return failure_reason != end_reason::kNotJudged; }
  bool success = false;
  double completion_time = 0;  // s
  // Why it came out so, in a sentence.
  std::string explanation;
  // What statistics are made of.
  metrics::EpisodeResult result;
  // The whole line, as it stands there: of many episodes a tenth of the memory.
  std::string text;
  nlohmann::ordered_json Json() const { return nlohmann::ordered_json::parse(text); }
  // Its number in episodes.jsonl, from 1.
  int line = 0;

  // Numbers of "metrics" and, below "extended.", of "extended", by their flattened names
  // ("cartesian_path_length.left"), in the line's order.
  metrics::NamedNumbers Values() const;
};

struct RecordedRun {
  std::filesystem::path folder;
  // The folder's own name, as it can be shown; of a run in a suite, SUITE/RUN.
  std::string name;
  // run.json, and what everybody asks it for.
  nlohmann::ordered_json info;
  std::string task;
  std::string variation;
  // Its name, as it was given, or what --policy said.
  std::string policy;
  int64_t seed = 0;
  // kRunSeeds, kCollectSeeds or kSharedSeeds (base/random.h).
  std::string seed_stream;
  SeedSource seeds() const { return {seed, seed_stream, task, variation}; }
  // Episodes asked for.
  int planned = 0;
  // Finished ones, by number; also those that are not complete.
  std::vector<RecordedEpisode> episodes;
  // Numbers of those begun and not finished (episodes/0007.partial).
  std::vector<int> unfinished;
  // The last line of episodes.jsonl, from 1, where it was cut off and is therefore left out; 0 where it was
  // not.
  int cut_line = 0;

  // As model_info_t.clock has it.
  const char* clock() const;
  // "lift_pot/position".
  std::string task_name() const { return task + "/" + variation; }
  std::vector<int> incomplete() const;  // but for invalid ones
  std::vector<int> invalid() const;
  metrics::RunStatistics Statistics() const;
  // What a reader of its rates has to know, one sentence each: stopped early, invalid, incomplete and equal
  // episodes.
  std::vector<std::string> Remarks() const;
};

// A suite: several runs made together; or one run alone.
struct RecordedRuns {
  std::filesystem::path folder;
  std::string name;
  bool is_suite = false;
  std::vector<RecordedRun> runs;
  // Runs that suite.json names and that have no finished episode.
  std::vector<std::string> missing;
};

// These throw InputError, one line: no such folder, no run folder, no finished episode; a line that is not
// JSON, lacks a key, repeats an episode, or belongs to another task, variation or seed.
RecordedRun ReadRun(const std::filesystem::path& folder);
RecordedRuns ReadRuns(const std::filesystem::path& folder);
// Of a folder with run.json; there may be no finished episode yet.
RecordedRun ReadRunAsFarAsItGot(const std::filesystem::path& folder);
// A line of episodes.jsonl of this run, which `where` names; without its text.
RecordedEpisode ReadEpisode(const nlohmann::ordered_json& json, const std::string& where,
                            const RecordedRun& run);
// What run.json alone says.
RecordedRun ReadRunInfo(const std::filesystem::path& folder);
// The seed_stream of a run.json; kSharedSeeds for an older one, which has none.
std::string SeedStreamOf(const nlohmann::ordered_json& info, const std::string& file);
// The folders in that of a suite, as suite.json names them.
std::vector<std::string> RunsInSuite(const std::filesystem::path& folder);

}  // namespace evalbus::results
