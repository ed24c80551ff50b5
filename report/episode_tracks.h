// Reads recorded episodes for pages and reports, and scores them from their logs as `evalbus rescore` does.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "results/run_reader.h"
#include "viz/viewer/episode_track.h"
#include "viz/viewer/run_block.h"
#include "viz/viewer/scene_blocks.h"

namespace evalbus::report {

// Builds each scene of the runs once. Thread-safe; a thread waits only for the scene that it needs.
class Scenes {
 public:
  using Block = std::shared_ptr<const std::string>;

  // Returns the scene of a MODEL in a log of the run in folder `run`. Throws InputError if its model files
  // are missing or do not match their hashes.
  const viz::SceneBlocks& Of(model_info_t model, const std::filesystem::path& run);
  // Returns all blocks of all scenes, by id.
  std::map<std::string, Block> blocks() const;
  // Returns a block; null if the id is unknown.
  Block FindBlock(const std::string& id) const;

 private:
  struct Entry {
    std::mutex mutex;
    std::unique_ptr<viz::SceneBlocks> scene;
  };
  // Protects the maps.
  mutable std::mutex mutex_;
  std::map<std::string, Entry> scenes_;
  std::map<std::string, Block> blocks_;
};

// Returns the last episode of the log, with poses if `scenes` is given. Throws InputError if the log cannot
// be read or contains no episode, and the errors of Scenes::Of().
std::unique_ptr<viz::EpisodeTrack> TrackEpisode(const std::filesystem::path& log,
                                                viz::EpisodeTrack::About about, Scenes* scenes = nullptr);

// Returns the last episode of the log with only its poses, gripper openings, images and the score at tick 0.
// It contains no outcome, later scores, events, seed, or names of policy and run. number: displayed as the
// number of the episode. Throws the errors of TrackEpisode().
std::unique_ptr<viz::EpisodeTrack> BlindTrack(const std::filesystem::path& log, int number, Scenes* scenes);

// is_over: true selects the Wilson interval, false the anytime-valid one.
viz::RunNumbers NumbersOf(const results::RecordedRun& run, int planned, const metrics::RunSummary& summary,
                          bool is_over);

// RunBlock() returns the block "run" of a recorded run; RowOf() and EpisodeRows() return rows of its block
// "episodes".
std::string RunBlock(const results::RecordedRun& run, int number);
viz::EpisodeRow RowOf(const results::RecordedEpisode& episode, const results::RecordedRun& run);
std::vector<viz::EpisodeRow> EpisodeRows(const results::RecordedRun& run);

}  // namespace evalbus::report
