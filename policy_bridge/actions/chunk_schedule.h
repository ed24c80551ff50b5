// Decides which row of which action chunk commands the robot at each control tick if an inference takes time.
// It uses only ticks and row numbers, neither a clock nor the actions themselves.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace evalbus::policy {

// What the robot does during an inference.
//   synchronous: it holds its last command. The next inference begins when the rows to execute are used up.
//   asynchronous: it continues with the last chunk. As soon as the new chunk arrives, it replaces the rest of
//     the last one. Its rows for the ticks that passed during the inference are skipped.
//   rtc: real-time chunking (Black et al. 2025, arXiv 2506.07339): as asynchronous, but the new chunk is
//     joined to the remaining rows of the last one (OlderWeight()).
enum class Execution { kSynchronous, kAsynchronous, kRealTimeChunking };

// Parses "synchronous", "asynchronous" or "rtc", as in --execution. Throws InputError.
Execution ParseExecution(const std::string& text);

class ChunkSchedule {
 public:
  // A row of a chunk. Chunks are numbered from 0 within an episode.
  struct Step {
    int64_t chunk = 0;
    int row = 0;
  };

  // execute_steps: number of rows, at least 1, after which the next inference begins. If the robot moves
  // during inferences, the next one begins earlier if its chunk would otherwise arrive too late.
  ChunkSchedule(Execution rule, int execute_steps);

  // Begins an episode: discards all chunks.
  void Begin();

  // Returns whether an inference must begin at this tick. False while an inference is running, and until its
  // chunk is in use.
  bool IsDue(int64_t tick);
  // Records that an inference begins with the observation of this tick.
  void Ask(int64_t tick);
  // Adds the chunk that answers the last Ask(): it has `num_rows` rows and commands the robot starting at
  // `tick`. May be called before that tick. Returns the number of the chunk.
  int64_t Arrive(int64_t tick, int num_rows);

  // Returns the row that commands the robot at this tick, or nullopt if the robot holds its last command.
  // Ticks must not decrease over the calls of At() and IsDue().
  std::optional<Step> At(int64_t tick);

  // Returns the tick that was observed for the chunk whose row At() returned last.
  int64_t observed_tick() const { return current_.observed; }

  // Overlap of the chunk that has just arrived with the last one, for rtc. delay: number of its first rows
  // whose ticks passed before it arrived. rows: number of its first rows for whose ticks the last chunk also
  // has a row (0: there is nothing to join). Row `i` of the new chunk belongs to the same tick as row `i +
  // offset` of the last one.
  struct Overlap {
    int delay = 0, rows = 0, offset = 0;
  };
  Overlap overlap() const { return overlap_; }

  // Rows that the robot executes, starting at this tick, if no other chunk arrives: `count` rows of the chunk
  // in use, beginning with row `first`.
  struct Rest {
    int64_t chunk = 0;
    int first = 0, count = 0;
  };
  Rest RestAt(int64_t tick);

 private:
  struct Chunk {
    int64_t number = -1;
    int64_t observed = 0;
    // arrival: first tick that the chunk commands. origin: tick to which its row 0 belongs.
    int64_t arrival = 0, origin = 0;
    int num_rows = 0;
  };
  void Advance(int64_t tick);
  // Returns the number of rows of the current chunk that may be executed.
  int usable_rows() const;

  Execution rule_;
  int execute_steps_;
  Chunk current_, next_;
  std::optional<int64_t> asked_;
  Overlap overlap_;
};

// Returns the weight of the last chunk in row `row` of a new chunk (the soft mask of real-time chunking). It
// is 1 for committed rows (row < delay), 0 for rows >= overlap, and decreases exponentially between them.
double OlderWeight(int row, int delay, int overlap);

// Joins a new chunk to the last chunk: each row within the overlap becomes the mean of both chunks, weighted
// by OlderWeight().
void JoinRows(std::span<const std::vector<double>> last, const ChunkSchedule::Overlap& overlap,
              std::vector<std::vector<double>>* rows);

}  // namespace evalbus::policy
