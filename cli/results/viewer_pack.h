// Chooses how many episodes go into a page that may not be larger than so much, and packs them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cli/results/episode_tracks.h"
#include "cli/results/page_links.h"
#include "cli/results/run_reader.h"
#include "viz/viewer/pack.h"

namespace evalbus::results {

// Of a page with a viewer, unless another is asked for.
inline constexpr double kPageMegabytes = 8;

class ViewerPack {
 public:
  // links: of the page. Throws EnvironmentError without three.js.
  explicit ViewerPack(const PageLinks& links);

  // Returns its number on the page.
  int Add(const RecordedRun& run);

  // Episode of a run, in the order in which they are wanted. Those packed together, one after the other,
  // stand together or not at all.
  struct Wanted {
    int run, episode;
  };
  // Packs what there is room for: stops at the first that there is none for. page: bytes of everything else
  // there, without the viewer; most: of the whole. Logs that cannot be read are remarks.
  void Pack(const std::vector<std::vector<Wanted>>& wanted, size_t page, size_t most);

  // Null where nothing is packed: an empty viewer would only make the page larger.
  std::optional<viz::PackedViewer> Viewer() const;
  // What is packed, a sentence.
  std::string Note() const;
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  std::string ListBlock(int run) const;

  PageLinks links_;
  viz::ThreeJs libraries_;
  std::vector<const RecordedRun*> runs_;
  Scenes scenes_;
  std::set<std::pair<int, int>> packed_;
  std::vector<std::pair<std::string, std::string>> blocks_;
  std::set<std::string> names_;
  std::vector<std::string> remarks_;
  size_t episodes_ = 0;
};

// Of a run's episodes: failures first, then those that succeeded, but for `first`, which come before all.
std::vector<int> FailuresFirst(const RecordedRun& run, const std::vector<int>& first);

}  // namespace evalbus::results
