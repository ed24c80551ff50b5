// Selects and packs the episodes that fit into a page of limited size.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "report/episode_tracks.h"
#include "report/page_links.h"
#include "results/run_reader.h"
#include "viz/viewer/page_files.h"

namespace evalbus::report {

// Default maximum size of a page with a 3D viewer.
inline constexpr double kPageMegabytes = 8;

class ViewerPack {
 public:
  // Throws EnvironmentError if three.js is missing.
  explicit ViewerPack(const PageLinks& links);

  // Adds a run and returns its number on the page.
  int Add(const results::RecordedRun& run);

  // An episode to pack. run: number that Add() returned.
  struct Wanted {
    int run, episode;
  };
  // Packs groups of episodes in the given order until one does not fit; a group is packed completely or not
  // at all. page: size of the page without the viewer, in bytes. most: maximum size of the page in bytes.
  // Groups with a log that cannot be read are skipped; remarks() describes the first three and counts the
  // rest.
  void Pack(const std::vector<std::vector<Wanted>>& wanted, size_t page, size_t most);

  // Returns true if the episode is packed.
  bool has(int run, int episode) const { return packed_.contains({run, episode}); }
  // Returns nullopt if no episode is packed: an empty viewer would only enlarge the page.
  std::optional<viz::PackedViewer> Viewer() const;
  // Returns a sentence that states which episodes are packed.
  std::string Note() const;
  std::vector<std::string> remarks() const;

 private:
  std::string ListBlock(int run) const;

  PageLinks links_;
  viz::ThreeJs libraries_;
  std::vector<const results::RecordedRun*> runs_;
  Scenes scenes_;
  std::set<std::pair<int, int>> packed_;
  std::vector<std::pair<std::string, std::string>> blocks_;
  std::set<std::string> names_;
  std::vector<std::string> remarks_;
  size_t episodes_ = 0, unreadable_ = 0;
  // True if an episode did not fit into the page.
  bool is_full_ = false;
};

// Returns the numbers of a run's episodes: first the episodes in `first`, then failures, then successes.
std::vector<int> FailuresFirst(const results::RecordedRun& run, const std::vector<int>& first);

}  // namespace evalbus::report
