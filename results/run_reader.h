// Reads the folders of runs and suites (docs/run_folder.md). An invalid line is an error with file and line.
// Only a truncated last line is ignored (RecordedRun::cut_line).
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
#include "models/task_family.h"

namespace evalbus::results {

// Decisive moment of an episode (docs/failures.md). All members are empty in runs of versions before 0.3.
struct Cause {
  std::string kind;
  double time_s = 0;
  // Description of the moment in one sentence.
  std::string text;
};

// A line of episodes.jsonl. Episodes that are not complete are excluded from all rates: ticks are missing,
// samples were rejected, or the episode is invalid. --resume runs invalid episodes again.
struct RecordedEpisode : metrics::EpisodeResult {
  int episode = 0;
  int64_t seed = 0;
  std::string end_reason;
  double completion_time = 0;  // s
  // Explains the result in one sentence.
  std::string explanation;
  Cause cause;
  // Note of a user (results/notes.h); empty if there is none.
  std::string note;
  // The unparsed line; uses a tenth of the memory of the parsed JSON.
  std::string text;
  nlohmann::ordered_json Json() const { return nlohmann::ordered_json::parse(text); }
  // Line number in episodes.jsonl, from 1.
  int line = 0;

  // Returns the numbers of "metrics" and "extended" by their flattened names, for example
  // "cartesian_path_length.left", in the line's order. Names from "extended" have the prefix
  // "extended.".
  metrics::NamedNumbers Values() const;
};

struct RecordedRun {
  std::filesystem::path folder;
  // The folder's name, made printable; SUITE/RUN for a run in a suite.
  std::string name;
  // Contents of run.json. The members below repeat its most used values.
  nlohmann::ordered_json info;
  std::string task;
  std::string variation;
  // policy_name or, if that is empty, the value of --policy.
  std::string policy;
  int64_t seed = 0;
  // Value of --seed-stream (base/random.h).
  std::string seed_stream;
  SeedSource seeds() const { return {seed, seed_stream, FamilyOf(task), variation}; }
  // Requested number of episodes (--episodes). With --only, the run evaluates only some of these episodes.
  int planned = 0;
  // Finished episodes by number, including incomplete ones.
  std::vector<RecordedEpisode> episodes;
  // Numbers of unfinished episodes (episodes/0007.partial).
  std::vector<int> unfinished;
  // Line number of a truncated last line of episodes.jsonl, which is ignored; 0 if there is none.
  int cut_line = 0;

  // Returns the value of model_info_t.clock.
  const char* clock() const;
  // Returns false for a run of an external source (`evalbus watch`, `evalbus score`).
  bool is_simulated() const;
  // Returns the version of MuJoCo that computed the physics; empty if nothing was simulated or run.json does
  // not name it.
  std::string engine() const;
  // Returns the task and the variation, for example "lift_pot/position".
  std::string task_name() const { return task + "/" + variation; }
  // Returns true if the run should evaluate this episode. With --only, these are only the listed episodes.
  bool IsPlanned(int episode) const;
  // Returns true if --only is given, as for a shard of a plan.
  bool is_part() const;
  // Returns the number of planned episodes; with --only, the number of listed episodes.
  int num_planned() const;
  // Returns true if `evalbus collect` has finished this run and kept only its successes.
  bool is_collection() const;
  // Returns true if the run may end before all planned episodes: the results decide when a run of a plan with
  // `until` ends, and the operator may end `evalbus watch`.
  bool may_end_early() const;
  std::vector<int> incomplete() const;  // without invalid ones
  std::vector<int> invalid() const;
  metrics::RunStatistics Statistics() const;
  // Notes on the rates, one line each, for example on a run that stopped early, and on invalid,
  // incomplete and equal episodes.
  std::vector<std::string> Remarks() const;
};

// A suite, which consists of several runs, or a single run.
struct RecordedRuns {
  std::filesystem::path folder;
  std::string name;
  bool is_suite = false;
  std::vector<RecordedRun> runs;
  // Runs listed in suite.json that have no finished episode.
  std::vector<std::string> missing;
};

// Throws InputError unless `folder` is a folder.
void CheckRunFolder(const std::filesystem::path& folder);
// ReadRun() and ReadRuns() throw InputError, with a message of one line, if the folder does not exist, is not
// a run folder, or has no finished episode. They also do so if a line is not JSON, lacks a key, repeats an
// episode, or belongs to another task, variation or seed.
RecordedRun ReadRun(const std::filesystem::path& folder);
RecordedRuns ReadRuns(const std::filesystem::path& folder);
// Reads a folder with run.json; the run may have no finished episode yet.
RecordedRun ReadRunAsFarAsItGot(const std::filesystem::path& folder);
// Parses a line of this run's episodes.jsonl. `where`: file and line for errors. The result's `text`, `line`
// and `note` are not set.
RecordedEpisode ReadEpisode(const nlohmann::ordered_json& json, const std::string& where,
                            const RecordedRun& run);
// Reads only run.json.
RecordedRun ReadRunInfo(const std::filesystem::path& folder);
// Returns the seed_stream of a run.json; kSharedSeeds if it is missing, as in older versions.
std::string SeedStreamOf(const nlohmann::ordered_json& info, const std::string& file);
// Returns the names of the run folders listed in a suite's suite.json.
std::vector<std::string> RunsInSuite(const std::filesystem::path& folder);

}  // namespace evalbus::results
