// Recorded episodes as a page or a report shows them: scored again from their logs as `evalbus rescore` does.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "cli/results/run_reader.h"
#include "viz/viewer/episode_track.h"
#include "viz/viewer/run_block.h"
#include "viz/viewer/scene_blocks.h"

namespace evalbus::results {

// The scenes of runs, each built once. Thread-safe: what one thread builds, only those wait for that want it.
class Scenes {
 public:
  using Block = std::shared_ptr<const std::string>;

  // Scene of a MODEL in the log of a run in this folder. Throws InputError where its model files are gone, or
  // are not its own.
  const viz::SceneBlocks& Of(model_info_t model, const std::filesystem::path& run);
  // Every block of all of them, by id.
  std::map<std::string, Block> blocks() const;
  // One of them; null: unknown.
  Block FindBlock(const std::string& id) const;

 private:
  struct Entry {
    std::mutex mutex;
    std::unique_ptr<viz::SceneBlocks> scene;
  };
  // Guards the maps.
  mutable std::mutex mutex_;
  std::map<std::string, Entry> scenes_;
  std::map<std::string, Block> blocks_;
};

// The last episode of the log. With `scenes`, its poses too. Throws InputError: cannot be read, or holds no
// episode.
std::unique_ptr<viz::EpisodeTrack> TrackEpisode(const std::filesystem::path& log,
                                                viz::EpisodeTrack::About about, Scenes* scenes = nullptr);

// The blocks "run" and "episodes" of a run on disk.
std::string RunBlock(const RecordedRun& run, int number);
viz::EpisodeRow RowOf(const RecordedEpisode& episode, const RecordedRun& run);
std::vector<viz::EpisodeRow> EpisodeRows(const RecordedRun& run);

}  // namespace evalbus::results
