// Decides which row of which action chunk commands the robot at each control tick if an inference takes time.
// It counts ticks only: no clock, no numbers of actions.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace evalbus::policy {

// What the robot does during an inference.
//   synchronous: it holds its last command; the next inference begins when the rows to execute are used up.
//   asynchronous: it continues with the last chunk. The new chunk replaces the rest of the last one as soon
//   as
//     it arrives. Its rows for the ticks that passed during the inference are skipped.
//   rtc: real-time chunking (Black et al. 2025, arXiv 2506.07339): as asynchronous, but the new chunk is
//     joined to the rows of the last one that were committed when the inference began (OlderWeight()).
enum class Execution { kSynchronous, kAsynchronous, kRealTimeChunking };

// Parses "synchronous", "asynchronous" or "rtc", as in --execution. Throws InputError.
Execution ParseExecution(const std::string& text);

class ChunkSchedule {
 public:
  // A row of a chunk; chunks are counted from 0 within the episode.
  struct Step {
    int64_t chunk = 0;
    int row = 0;
  };

  // execute_steps: number of rows after which the next inference begins, at least 1.
  ChunkSchedule(Execution rule, int execute_steps);

  // Discards all chunks: an episode begins.
  void Begin();

  // Whether an inference must begin at this tick. False until the last one has arrived.
  bool IsDue(int64_t tick);
  // The policy observes this tick.
  void Ask(int64_t tick);
  // The answer to the last Ask() has `num_rows` rows, and commands the robot from `tick` on. May be called
  // before that tick. Returns the number of the chunk.
  int64_t Arrive(int64_t tick, int num_rows);

  // Row that commands the robot at this tick; nothing: the robot holds its last command. Ticks must not
  // decrease between calls of this and IsDue().
  std::optional<Step> At(int64_t tick);

  // Tick that was observed for the chunk of the last At() that returned a row.
  int64_t observed_tick() const { return current_.observed; }

  // For rtc, of the chunk that has just arrived: number of its first rows during which the last chunk still
  // commanded the robot, and number of its first rows for which the last chunk has a row, too (0: there was
  // no chunk to join). Row `i` of the new chunk belongs to the same tick as row `i + offset` of the last one.
  struct Overlap {
    int delay = 0, rows = 0, offset = 0;
  };
  Overlap overlap() const { return overlap_; }

  // Rows of the chunk in use from this tick on, as {first, count}: what the robot executes if no other chunk
  // arrives.
  struct Rest {
    int64_t chunk = 0;
    int first = 0, count = 0;
  };
  Rest RestAt(int64_t tick);

 private:
  struct Chunk {
    int64_t number = -1;
    int64_t observed = 0;
    // First tick that the chunk commands, and the tick to which its row 0 belongs.
    int64_t arrival = 0, origin = 0;
    int num_rows = 0;
  };
  void Advance(int64_t tick);
  // Number of rows that may be executed.
  int usable_rows() const;

  Execution rule_;
  int execute_steps_;
  Chunk current_, next_;
  std::optional<int64_t> asked_;
  Overlap overlap_;
};

// Share of the last chunk in row `row` of a new one that overlaps it; the soft mask of real-time chunking: 1
// for committed rows (row < delay), 0 from row `overlap` on, and exponentially decreasing between them.
double OlderWeight(int row, int delay, int overlap);

// Joins a new chunk to the last one: each row within the overlap becomes the mean of both, weighted by
// OlderWeight().
void JoinRows(std::span<const std::vector<double>> last, const ChunkSchedule::Overlap& overlap,
              std::vector<std::vector<double>>* rows);

}  // namespace evalbus::policy
