#include "policy_bridge/actions/chunk_schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"

namespace evalbus::policy {

Execution ParseExecution(const std::string& text) {
  if (text == "synchronous") return Execution::kSynchronous;
  if (text == "asynchronous") return Execution::kAsynchronous;
  if (text == "rtc") return Execution::kRealTimeChunking;
  throw InputError("--execution: expected synchronous, asynchronous or rtc, got '" + text + "'");
}

ChunkSchedule::ChunkSchedule(Execution rule, int execute_steps)
    : rule_(rule), execute_steps_(execute_steps) {}

void ChunkSchedule::Begin() {
  current_ = next_ = {};
  asked_.reset();
  overlap_ = {};
}

void ChunkSchedule::Advance(int64_t tick) {
  if (next_.number > current_.number && tick >= next_.arrival) current_ = next_;
}

int ChunkSchedule::usable_rows() const {
  return rule_ == Execution::kSynchronous ? std::min(execute_steps_, current_.num_rows) : current_.num_rows;
}

bool ChunkSchedule::IsDue(int64_t tick) {
  Advance(tick);
  if (asked_ || next_.number > current_.number) return false;
  if (current_.number < 0) return true;
  int64_t rows = usable_rows();
  if (rule_ != Execution::kSynchronous) {
    // The inference begins so early that its chunk arrives before the rows are used up, if it takes as long
    // as the last one.
    const int64_t delay = current_.arrival - current_.observed;
    rows = std::min<int64_t>(execute_steps_, std::max<int64_t>(1, current_.num_rows - delay));
  }
  return tick >= current_.origin + rows;
}

void ChunkSchedule::Ask(int64_t tick) { asked_ = tick; }

int64_t ChunkSchedule::Arrive(int64_t tick, int num_rows) {
  next_ = {current_.number + 1, asked_.value_or(tick), tick, tick, num_rows};
  asked_.reset();
  overlap_ = {};
  // The robot does not move during the first inference of an episode, so no rows are skipped.
  if (rule_ == Execution::kSynchronous || current_.number < 0) return next_.number;
  next_.origin = next_.observed;
  overlap_ = {.delay = static_cast<int>(tick - next_.origin),
              .rows = static_cast<int>(
                  std::clamp<int64_t>(current_.origin + current_.num_rows - next_.origin, 0, num_rows)),
              .offset = static_cast<int>(next_.origin - current_.origin)};
  return next_.number;
}

std::optional<ChunkSchedule::Step> ChunkSchedule::At(int64_t tick) {
  Advance(tick);
  if (current_.number < 0) return std::nullopt;
  int64_t row = tick - current_.origin;
  // If all rows of a chunk passed during the inference, its last row is still executed.
  if (tick == current_.arrival) row = std::min<int64_t>(row, usable_rows() - 1);
  if (row >= usable_rows()) return std::nullopt;
  return Step{current_.number, static_cast<int>(row)};
}

ChunkSchedule::Rest ChunkSchedule::RestAt(int64_t tick) {
  Advance(tick);
  if (current_.number < 0) return {};
  const auto first = static_cast<int>(std::min<int64_t>(tick - current_.origin, usable_rows()));
  return {current_.number, first, usable_rows() - first};
}

double OlderWeight(int row, int delay, int overlap) {
  if (row >= overlap) return 0;
  if (row < delay) return 1;
  const double c = static_cast<double>(overlap - row) / (overlap - delay + 1);
  return c * std::expm1(c) / (std::numbers::e - 1);
}

void JoinRows(std::span<const std::vector<double>> last, const ChunkSchedule::Overlap& overlap,
              std::vector<std::vector<double>>* rows) {
  for (int i = 0; i < overlap.rows; ++i) {
    const double older = OlderWeight(i, overlap.delay, overlap.rows);
    const std::vector<double>& from = last[static_cast<size_t>(i + overlap.offset)];
    std::vector<double>& to = (*rows)[static_cast<size_t>(i)];
    for (size_t j = 0; j < to.size(); ++j) to[j] = older * from[j] + (1 - older) * to[j];
  }
}

}  // namespace evalbus::policy
