// Holds the current state of all runs on the page, and determines which blocks each viewer lacks. It stores
// only the position of each viewer. There are no queues for slow viewers; they receive the current state at
// their next read. Blocks are opaque bytes (docs/viewer_data.md). Thread-safe: the thread that tracks the
// runs writes, and the server's thread reads.
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
  // Maximum number and total size of the tick blocks that are kept for slow viewers. A viewer that is farther
  // behind receives the whole episode.
  static constexpr size_t kKeptTicks = 60;
  static constexpr size_t kKeptTickBytes = size_t{4} << 20;
  // kListBlock: number of episodes per block of a list. kKeptLines: number of log lines that are kept for new
  // viewers.
  static constexpr size_t kListBlock = 1000, kKeptLines = 200;

  // The position of a viewer: the blocks that it has received.
  class Viewer {
   public:
    int watched() const { return watched_; }

   private:
    friend class UpdateBroadcaster;
    struct Seen {
      uint64_t run = 0, notes = 0, list = 0;
      size_t episodes = 0;
      uint64_t lines = 0;
    };
    std::vector<Seen> seen_;
    uint64_t board_ = 0;
    int watched_ = 0;
    // next_ticks_: index of the next tick block of the watched run. Valid only if has_episode_: a whole
    // episode has been sent.
    bool has_episode_ = false;
    uint64_t next_ticks_ = 0;
    bool waits_for_episode_ = false;
  };

  // Replaces the `board` block, which covers all runs.
  void SetBoard(std::string block);

  // In the functions below, runs are numbered from 0. The first use of a number creates the run.

  // Replaces the run's `run` block.
  void SetRun(int run, std::string block);
  // Replaces the episodes, starting at index `from`.
  void SetEpisodes(int run, size_t from, std::vector<EpisodeRow> episodes);
  size_t num_episodes(int run) const;
  // Replaces the run's `notes` block.
  void SetNotes(int run, std::string block);
  // Appends log lines.
  void AddLines(int run, const std::vector<LogLine>& lines);
  // Sets the `episode` block of the current episode, which contains all ticks so far. is_new: whether viewers
  // must discard the previous block, e.g. because the episode is a different one.
  void SetEpisode(int run, std::string block, bool is_new);
  // Appends a `ticks` block to the current episode.
  void AddTicks(int run, std::string block);
  // Removes the current episode. Must be called if there is no episode to show.
  void ForgetEpisode(int run);

  // is_watched: whether at least one viewer watches this run. needs_episode: whether at least one of these
  // viewers needs a new `episode` block.
  bool is_watched(int run) const;
  bool needs_episode(int run) const;

  void Enter(Viewer* viewer);
  void Leave(Viewer* viewer);
  // Makes the viewer watch a run. Returns false if the run does not exist.
  bool Watch(Viewer* viewer, int run);
  // Returns the next block for a viewer, or null if there is none. The block then counts as sent.
  SharedBytes Next(Viewer* viewer);
  int num_viewers() const;

 private:
  struct Run {
    SharedBytes block;
    uint64_t version = 0;
    SharedBytes notes;
    uint64_t notes_version = 0;
    std::vector<EpisodeRow> episodes;
    // A viewer with an older version of the list receives the whole list again.
    uint64_t list_version = 1;
    // The most recent block of the list, cached for other viewers at the same position.
    SharedBytes list_block;
    size_t list_from = 0, list_to = 0;
    std::deque<LogLine> lines;
    uint64_t lines_begin = 0;
    // Tick blocks. The index of the first block is first_ticks.
    std::deque<SharedBytes> ticks;
    size_t tick_bytes = 0;
    uint64_t first_ticks = 0;
    // episode: `episode` block of the current episode. episode_begin: index of the episode's first tick
    // block. episode_next: index of the first tick block that is not contained in `episode`.
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
  SharedBytes board_;
  uint64_t board_version_ = 0;
  std::vector<std::unique_ptr<Run>> runs_;
  int num_viewers_ = 0;
};

}  // namespace evalbus::viz
