// What there is to tell viewers of the runs that a page shows, and what each of them lacks. A viewer is only
// a place in it: who reads slowly is not queued for, but told what stands now when it reads again. Knows
// blocks as bytes (docs/viewer_data.md). Thread-safe: who follows the runs writes, the server's thread reads.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "viz/viewer/run_block.h"

namespace evalbus::viz {

using SharedBytes = std::shared_ptr<const std::string>;

class UpdateBroadcaster {
 public:
  // Ticks that are kept for who is behind: a viewer that is further behind is given the whole episode.
  static constexpr size_t kKeptTicks = 60;
  static constexpr size_t kKeptTickBytes = size_t{4} << 20;
  // Episodes of a list in one block, and lines of a log that are kept for who comes.
  static constexpr size_t kListBlock = 1000, kKeptLines = 200;

  // Where a viewer is.
  class Viewer {
   public:
    int watched() const { return watched_; }

   private:
    friend class UpdateBroadcaster;
    struct Seen {
      uint64_t run = 0, list = 0;
      size_t episodes = 0;
      uint64_t lines = 0;
    };
    std::vector<Seen> seen_;
    int watched_ = 0;
    // Number of the next ticks to be sent of the run that it watches; nothing before a whole episode.
    bool has_episode_ = false;
    uint64_t next_ticks_ = 0;
    bool waits_for_episode_ = false;
  };

  // Runs are counted from 0; one that is named is there from then on.

  // A `run` block, in place of the one before.
  void SetRun(int run, std::string block);
  // The list of a run's episodes: those from `from` on become these.
  void SetEpisodes(int run, size_t from, std::vector<EpisodeRow> episodes);
  size_t num_episodes(int run) const;
  // Lines of logs, behind those there are.
  void AddLines(int run, const std::vector<LogLine>& lines);
  // An `episode` block of the episode under way, with all there was up to now; is_new: of another one than
  // before.
  void SetEpisode(int run, std::string block, bool is_new);
  // A `ticks` block behind it.
  void AddTicks(int run, std::string block);
  // There is no episode under way any more that could be shown.
  void ForgetEpisode(int run);

  // Somebody watches this run; somebody needs an `episode` block of it that is not there.
  bool is_watched(int run) const;
  bool needs_episode(int run) const;

  void Enter(Viewer* viewer);
  void Leave(Viewer* viewer);
  // False for a run that is not there.
  bool Watch(Viewer* viewer, int run);
  // The next block for a viewer, which then counts as sent; null if it has all.
  SharedBytes Next(Viewer* viewer);
  int num_viewers() const;

 private:
  struct Run {
    SharedBytes block;
    uint64_t version = 0;
    std::vector<EpisodeRow> episodes;
    // Of the list: a viewer with another one is sent all of it again.
    uint64_t list_version = 1;
    // The last block of the list that was made, for the next viewer at the same place.
    SharedBytes list_block;
    size_t list_from = 0, list_to = 0;
    std::deque<LogLine> lines;
    uint64_t lines_begin = 0;
    // Blocks of ticks number first_ticks and on.
    std::deque<SharedBytes> ticks;
    size_t tick_bytes = 0;
    uint64_t first_ticks = 0;
    // The number of ticks that the episode under way begins with; the block of it and which ticks follow
    // that.
    uint64_t episode_begin = 0;
    SharedBytes episode;
    uint64_t episode_next = 0;
    int watchers = 0, waiting = 0;

    uint64_t end_ticks() const { return first_ticks + ticks.size(); }
    bool has_all_behind(uint64_t number) const { return number >= first_ticks && number >= episode_begin; }
  };
  Run& At(int run);
  SharedBytes NextOfList(int number, Run* run, Viewer::Seen* seen);
  SharedBytes NextOfLog(int number, const Run& run, Viewer::Seen* seen);
  SharedBytes NextOfEpisode(Run* run, Viewer* viewer);
  void StopWaiting(Viewer* viewer);

  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Run>> runs_;
  int num_viewers_ = 0;
};

}  // namespace evalbus::viz
