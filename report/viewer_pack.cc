#include "report/viewer_pack.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/text.h"
#include "results/episode_logs.h"

namespace evalbus::report {
namespace {

// Maximum size of the camera images of an episode on a page.
constexpr size_t kImageBytes = size_t{1} << 20;
// Size of a block's HTML element in bytes, without its name and text.
constexpr size_t kElement = 80;

// Maximum number of unreadable logs that are named.
constexpr size_t kMaxRemarks = 3;

using Block = std::pair<std::string, std::string>;

size_t SizeOf(const Block& block) { return block.first.size() + block.second.size() + kElement; }

}  // namespace

ViewerPack::ViewerPack(const PageLinks& links) : links_(links), libraries_(viz::ReadThreeJs()) {}

int ViewerPack::Add(const results::RecordedRun& run) {
  runs_.push_back(&run);
  episodes_ += run.episodes.size();
  return static_cast<int>(runs_.size()) - 1;
}

std::string ViewerPack::ListBlock(int number) const {
  const results::RecordedRun& run = *runs_[static_cast<size_t>(number)];
  std::vector<viz::EpisodeRow> rows = EpisodeRows(run);
  for (viz::EpisodeRow& row : rows) {
    row.has_track = packed_.contains({number, row.episode});
    const std::vector<ReportLink> videos = links_.Videos(run.folder, row.episode);
    if (!videos.empty()) row.video = videos.front().url;
  }
  return viz::EpisodesBlock(number, 0, rows);
}

void ViewerPack::Pack(const std::vector<std::vector<Wanted>>& wanted, size_t page, size_t most) {
  size_t size = page + libraries_.three.size() + libraries_.orbit_controls.size();
  for (const viz::PageFile& file : viz::PageFiles()) size += std::string_view(file.text).size() + kElement;
  for (int run = 0; run < static_cast<int>(runs_.size()); ++run) {
    // 10 % and 100 bytes are added, because the final block marks the packed episodes.
    size += 2 * kElement + viz::Packed(ListBlock(run)).size() * 11 / 10 + 100;
    size += viz::Packed(RunBlock(*runs_[static_cast<size_t>(run)], run)).size();
  }
  for (const std::vector<Wanted>& together : wanted) {
    std::vector<Block> blocks;
    std::set<std::string> names;
    const auto add = [&](const std::string& name, const std::string& bytes) {
      if (!names_.contains(name) && names.insert(name).second) blocks.emplace_back(name, viz::Packed(bytes));
    };
    try {
      for (const Wanted& episode : together) {
        const results::RecordedRun& run = *runs_[static_cast<size_t>(episode.run)];
        const auto track = TrackEpisode(
            results::EpisodeLogs(run.folder, {episode.episode}).front(),
            {.run = episode.run, .policy = run.policy, .scene = {}, .bodies = {}, .image_bytes = kImageBytes},
            &scenes_);
        for (const auto& [id, bytes] : scenes_.Of(track->model(), run.folder).blocks()) add(id, bytes);
        add(fmt::format("episode/{}/{}", episode.run, episode.episode), track->EpisodeBlock());
      }
    } catch (const InputError& error) {
      ++unreadable_;
      if (remarks_.size() < kMaxRemarks) {
        remarks_.push_back(
            fmt::format("episode {} is not shown in 3D: {}", together.front().episode, error.what()));
      }
      continue;
    }
    size_t more = 0;
    for (const Block& block : blocks) more += SizeOf(block);
    if (size + more > most) {
      is_full_ = true;
      return;
    }
    size += more;
    names_.insert(names.begin(), names.end());
    std::ranges::move(blocks, std::back_inserter(blocks_));
    for (const Wanted& episode : together) packed_.emplace(episode.run, episode.episode);
  }
}

std::string ViewerPack::Note() const {
  if (packed_.empty()) {
    if (is_full_) return "No episode fits into the page in 3D: increase --mb.";
    return "No episode can be played in 3D" + (remarks_.empty() ? "." : ": " + remarks_.front());
  }
  if (packed_.size() < episodes_)
    return fmt::format("{} of {} episodes can be played in 3D.", packed_.size(), episodes_);
  return fmt::format("{} can be played in 3D.", Plural(episodes_, "episode"));
}

std::vector<std::string> ViewerPack::remarks() const {
  std::vector<std::string> remarks = remarks_;
  if (const size_t more = unreadable_ - remarks.size(); more > 0)
    remarks.push_back(fmt::format("{} more {} not shown in 3D for such reasons", more,
                                  more == 1 ? "episode is" : "episodes are"));
  return remarks;
}

std::optional<viz::PackedViewer> ViewerPack::Viewer() const {
  if (packed_.empty()) return std::nullopt;
  viz::PackedViewer viewer{.blocks = {}, .libraries = libraries_, .note = Note()};
  for (int run = 0; run < static_cast<int>(runs_.size()); ++run) {
    viewer.blocks.emplace_back(fmt::format("run/{}", run),
                               viz::Packed(RunBlock(*runs_[static_cast<size_t>(run)], run)));
    viewer.blocks.emplace_back(fmt::format("episodes/{}", run), viz::Packed(ListBlock(run)));
  }
  viewer.blocks.insert(viewer.blocks.end(), blocks_.begin(), blocks_.end());
  return viewer;
}

std::vector<int> FailuresFirst(const results::RecordedRun& run, const std::vector<int>& first) {
  std::vector<int> order = first;
  for (const bool success : {false, true}) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      if (episode.success == success && std::ranges::find(first, episode.episode) == first.end()) {
        order.push_back(episode.episode);
      }
    }
  }
  return order;
}

}  // namespace evalbus::report
