#include "viz/web/update_broadcaster.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace evalbus::viz {
namespace {

SharedBytes Shared(std::string bytes) { return std::make_shared<const std::string>(std::move(bytes)); }

template <class Rows>
auto Part(const Rows& rows, size_t from, size_t to) {
  return std::vector<typename Rows::value_type>(rows.begin() + static_cast<std::ptrdiff_t>(from),
                                                rows.begin() + static_cast<std::ptrdiff_t>(to));
}

}  // namespace

UpdateBroadcaster::Run& UpdateBroadcaster::At(int run) {
  while (runs_.size() <= static_cast<size_t>(run)) runs_.push_back(std::make_unique<Run>());
  return *runs_[static_cast<size_t>(run)];
}

void UpdateBroadcaster::SetBoard(std::string block) {
  const std::lock_guard lock(mutex_);
  board_ = Shared(std::move(block));
  ++board_version_;
}

void UpdateBroadcaster::SetNotes(int run, std::string block) {
  const std::lock_guard lock(mutex_);
  Run& to = At(run);
  to.notes = Shared(std::move(block));
  ++to.notes_version;
}

void UpdateBroadcaster::SetRun(int run, std::string block) {
  const std::lock_guard lock(mutex_);
  Run& to = At(run);
  to.block = Shared(std::move(block));
  ++to.version;
}

void UpdateBroadcaster::SetEpisodes(int run, size_t from, std::vector<EpisodeRow> episodes) {
  const std::lock_guard lock(mutex_);
  Run& to = At(run);
  from = std::min(from, to.episodes.size());
  if (from < to.episodes.size()) ++to.list_version;  // viewers have an outdated part of the list
  to.episodes.resize(from);
  std::ranges::move(episodes, std::back_inserter(to.episodes));
  to.list_block = nullptr;
}

size_t UpdateBroadcaster::num_episodes(int run) const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(run) < runs_.size() ? runs_[static_cast<size_t>(run)]->episodes.size() : 0;
}

void UpdateBroadcaster::AddLines(int run, const std::vector<LogLine>& lines) {
  const std::lock_guard lock(mutex_);
  Run& to = At(run);
  for (const LogLine& line : lines) to.lines.push_back(line);
  while (to.lines.size() > kKeptLines) {
    to.lines.pop_front();
    ++to.lines_begin;
  }
}

void UpdateBroadcaster::SetEpisode(int run, std::string block, bool is_new) {
  const std::lock_guard lock(mutex_);
  Run& to = At(run);
  if (is_new) {
    to.first_ticks = to.episode_begin = to.end_ticks() + 1;
    to.ticks.clear();
    to.tick_bytes = 0;
  }
  to.episode = Shared(std::move(block));
  to.episode_next = to.end_ticks();
}

void UpdateBroadcaster::AddTicks(int run, std::string block) {
  const std::lock_guard lock(mutex_);
  Run& to = At(run);
  to.tick_bytes += block.size();
  to.ticks.push_back(Shared(std::move(block)));
  while (to.ticks.size() > kKeptTicks || to.tick_bytes > kKeptTickBytes) {
    to.tick_bytes -= to.ticks.front()->size();
    to.ticks.pop_front();
    ++to.first_ticks;
  }
}

void UpdateBroadcaster::ForgetEpisode(int run) {
  const std::lock_guard lock(mutex_);
  At(run).episode = nullptr;
}

bool UpdateBroadcaster::is_watched(int run) const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(run) < runs_.size() && runs_[static_cast<size_t>(run)]->watchers > 0;
}

bool UpdateBroadcaster::needs_episode(int run) const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(run) < runs_.size() && runs_[static_cast<size_t>(run)]->waiting > 0;
}

int UpdateBroadcaster::num_viewers() const {
  const std::lock_guard lock(mutex_);
  return num_viewers_;
}

void UpdateBroadcaster::Enter(Viewer* viewer) {
  const std::lock_guard lock(mutex_);
  *viewer = Viewer();
  ++At(0).watchers;
  ++num_viewers_;
}

void UpdateBroadcaster::Leave(Viewer* viewer) {
  const std::lock_guard lock(mutex_);
  StopWaiting(viewer);
  --At(viewer->watched_).watchers;
  --num_viewers_;
}

bool UpdateBroadcaster::Watch(Viewer* viewer, int run) {
  const std::lock_guard lock(mutex_);
  if (run < 0 || static_cast<size_t>(run) >= runs_.size()) return false;
  if (run == viewer->watched_) return true;
  StopWaiting(viewer);
  --At(viewer->watched_).watchers;
  viewer->watched_ = run;
  viewer->has_episode_ = false;
  ++At(run).watchers;
  return true;
}

void UpdateBroadcaster::StopWaiting(Viewer* viewer) {
  if (std::exchange(viewer->waits_for_episode_, false)) --At(viewer->watched_).waiting;
}

SharedBytes UpdateBroadcaster::Next(Viewer* viewer) {
  const std::lock_guard lock(mutex_);
  viewer->seen_.resize(runs_.size());
  // The board is sent first, because the page selects its first view from it.
  if (viewer->board_ != board_version_) {
    viewer->board_ = board_version_;
    return board_;
  }
  for (size_t i = 0; i < runs_.size(); ++i) {
    if (!runs_[i]->block || viewer->seen_[i].run == runs_[i]->version) continue;
    viewer->seen_[i].run = runs_[i]->version;
    return runs_[i]->block;
  }
  // Ticks have priority over long lists, so lists are sent one block at a time.
  const size_t watched = static_cast<size_t>(viewer->watched_);
  if (watched < runs_.size()) {
    if (SharedBytes block = NextOfEpisode(runs_[watched].get(), viewer)) return block;
  }
  for (size_t i = 0; i < runs_.size(); ++i) {
    const int number = static_cast<int>(i);
    if (viewer->seen_[i].notes != runs_[i]->notes_version) {
      viewer->seen_[i].notes = runs_[i]->notes_version;
      return runs_[i]->notes;
    }
    if (SharedBytes block = NextOfList(number, runs_[i].get(), &viewer->seen_[i])) return block;
    if (SharedBytes block = NextOfLog(number, *runs_[i], &viewer->seen_[i])) return block;
  }
  return nullptr;
}

SharedBytes UpdateBroadcaster::NextOfList(int number, Run* run, Viewer::Seen* seen) {
  // A list that has become empty is also sent, because the viewer still shows its former rows.
  const bool must_clear = seen->list != run->list_version && seen->episodes > 0;
  if (seen->list != run->list_version) {
    seen->list = run->list_version;
    seen->episodes = 0;
  }
  const size_t from = seen->episodes, to = std::min(run->episodes.size(), from + kListBlock);
  if (from == to && !must_clear) return nullptr;
  if (!run->list_block || run->list_from != from || run->list_to != to) {
    run->list_block = Shared(EpisodesBlock(number, from, Part(run->episodes, from, to)));
    run->list_from = from;
    run->list_to = to;
  }
  seen->episodes = to;
  return run->list_block;
}

SharedBytes UpdateBroadcaster::NextOfLog(int number, const Run& run, Viewer::Seen* seen) {
  const uint64_t end = run.lines_begin + run.lines.size();
  const uint64_t from = std::max(seen->lines, run.lines_begin);
  if (from == end) return nullptr;
  seen->lines = end;
  const auto begin = static_cast<size_t>(from - run.lines_begin);
  return Shared(LogBlock(number, Part(run.lines, begin, run.lines.size())));
}

SharedBytes UpdateBroadcaster::NextOfEpisode(Run* run, Viewer* viewer) {
  if (!viewer->has_episode_ || !run->has_all_behind(viewer->next_ticks_)) {
    if (!run->episode || !run->has_all_behind(run->episode_next)) {
      if (!std::exchange(viewer->waits_for_episode_, true)) ++run->waiting;
      return nullptr;
    }
    StopWaiting(viewer);
    viewer->has_episode_ = true;
    viewer->next_ticks_ = run->episode_next;
    return run->episode;
  }
  if (viewer->next_ticks_ >= run->end_ticks()) return nullptr;
  return run->ticks[static_cast<size_t>(viewer->next_ticks_++ - run->first_ticks)];
}

}  // namespace evalbus::viz
