#include "report/run_follower.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "report/episode_tracks.h"
#include "results/compared_runs.h"

namespace evalbus::report {
namespace fs = std::filesystem;
namespace {

// Adds the stage names in a line of episodes.jsonl. Lines of older versions contain no names.
void AddStageNames(const nlohmann::ordered_json& line, const metrics::EpisodeResult& result,
                   std::map<int, std::string>* names) {
  const auto named = line.find("stage_names");
  if (named == line.end() || !named->is_object()) return;
  for (const auto& [index, is_reached] : result.stages) {
    const auto name = named->find(std::to_string(index));
    if (name != named->end() && name->is_string()) (*names)[index] = *name;
  }
}

}  // namespace

RunFollower::RunFollower(fs::path folder) : folder_(std::move(folder)), lines_(File()) {
  numbers_.is_over = false;
}

void RunFollower::StartAgain() {
  lines_ = results::NewLines(File());
  waiting_.clear();
  next_waiting_ = 0;
  hashes_.clear();
  statistics_ = metrics::RunStatistics();
  info_->episodes.clear();
  stage_names_.clear();
}

void RunFollower::ReadInfo() {
  results::RecordedRun info = results::ReadRunInfo(folder_);
  if (info_) info.episodes = std::move(info_->episodes);
  info_ = std::move(info);
  if (!info_->episodes.empty()) SetModel();
}

void RunFollower::SetModel() {
  try {
    results::SetPhysicsHash(&*info_);
  } catch (const InputError&) {
    // A run without its model can be shown but not compared.
  }
}

bool RunFollower::ReadLines() {
  struct stat status {};
  if (stat(File().c_str(), &status) != 0) return inode_ == 0 || hashes_.empty();
  const bool is_another = inode_ != 0 && inode_ != status.st_ino;
  if (is_another) {
    // A run sorts episodes.jsonl when it ends, and --resume rewrites the lines that it keeps.
    results::NewLines lines(File());
    std::vector<std::string> all = lines.Next();
    const bool begins_alike = all.size() >= hashes_.size() &&
                              std::ranges::equal(hashes_.begin(), hashes_.end(), all.begin(),
                                                 all.begin() + static_cast<std::ptrdiff_t>(hashes_.size()),
                                                 {}, {}, std::hash<std::string>());
    if (!begins_alike) return false;
    all.erase(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(hashes_.size()));
    lines_ = std::move(lines);
    waiting_ = std::move(all);
    next_waiting_ = 0;
  } else if (next_waiting_ == waiting_.size()) {
    waiting_ = lines_.Next();
    next_waiting_ = 0;
  }
  // Not set if reading throws, so that the file is compared at the next attempt.
  inode_ = status.st_ino;
  return true;
}

bool RunFollower::IsFinished() const {
  if (next_waiting_ < waiting_.size() || !fs::exists(folder_ / kSummaryJson)) return false;
  if (!info_) return true;
  return info_->may_end_early() || info_->is_collection() ||
         std::cmp_greater_equal(hashes_.size(), info_->num_planned());
}

RunFollower::News RunFollower::Update() {
  News news;
  try {
    std::error_code none;
    const auto info_time = fs::last_write_time(folder_ / kRunJson, none);
    if (!none && (!info_ || info_time != info_time_)) {
      const bool is_first = !info_;
      ReadInfo();
      info_time_ = info_time;
      news.is_changed = true;
      // The folder may now contain a different run, whose files may have the inodes of the removed ones.
      if (!is_first) {
        StartAgain();
        inode_ = 0;
      }
    }
    if (!info_) return news;
    if (!ReadLines()) {
      StartAgain();
      inode_ = 0;
      ReadLines();
      news.is_changed = true;
    }
    const size_t end = std::min(waiting_.size(), next_waiting_ + kLinesAtOnce);
    for (; next_waiting_ < end; ++next_waiting_) {
      const std::string& text = waiting_[next_waiting_];
      const auto number = static_cast<int>(hashes_.size()) + 1;
      const auto line = ParseJson<nlohmann::ordered_json>(text, File().string(), number);
      if (hashes_.empty()) SetModel();
      results::RecordedEpisode episode =
          results::ReadEpisode(line, fmt::format("{}:{}", File().string(), number), *info_);
      statistics_.Add(episode.episode, episode);
      news.rows.push_back(RowOf(episode, *info_));
      AddStageNames(line, episode, &stage_names_);
      info_->episodes.push_back(std::move(episode));
      hashes_.push_back(std::hash<std::string>()(text));
    }
    error_.clear();
  } catch (const InputError& error) {
    // Lines after the invalid one are not read. The error is reported once.
    news.is_changed |= error_ != error.what();
    error_ = error.what();
  }
  // Also set after an error, because a viewer removes the rows from this index on.
  news.from = hashes_.size() - news.rows.size();
  const bool is_over = IsFinished();
  news.is_changed |= !news.rows.empty() || is_over != numbers_.is_over;
  numbers_.is_over = is_over;
  // The summary takes longer than reading kLinesAtOnce lines, so it is computed for the first lines and
  // after the last one.
  const bool has_more = next_waiting_ < waiting_.size() && error_.empty();
  if (news.is_changed && info_ && !(has_more && numbers_.done > 0))
    numbers_ = NumbersOf(*info_, info_->num_planned(), statistics_.Summary(false), is_over);
  return news;
}

}  // namespace evalbus::report
