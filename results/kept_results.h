// The results in episodes.jsonl, for comparison with the logs from which they were computed.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/rescorer.h"

namespace evalbus::results {

class KeptResults {
 public:
  // Reads the results of a run or a suite; a single log has none. Throws InputError for invalid lines.
  explicit KeptResults(const std::filesystem::path& recording);

  // Returns a text that states how the line in episodes.jsonl differs from the score of this log. Returns ""
  // if they are equal or if there are no results at all. Must be called at most once per log.
  std::string Difference(const std::filesystem::path& log, const RescoredEpisode& episode);
  // Returns the logs for whose lines Difference() was not called. If it was called for every log that exists,
  // these logs are missing.
  std::vector<std::filesystem::path> Missing() const;

 private:
  bool any_ = false;
  std::map<std::filesystem::path, nlohmann::ordered_json> lines_;
};

}  // namespace evalbus::results
