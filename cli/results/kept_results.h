// What episodes.jsonl says, to be held against the logs that it was made from.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/results/rescorer.h"

namespace evalbus::results {

class KeptResults {
 public:
  // Of a run or a suite; of a log alone there are none. Throws InputError for lines that no reader takes.
  explicit KeptResults(const std::filesystem::path& recording);

  // How the line of this log's episode differs from its score, as people read it; empty where it does not, or
  // where there are no lines at all. To be asked once of each log.
  std::string Difference(const std::filesystem::path& log, const RescoredEpisode& episode);
  // Logs of lines that have not been asked for: they are gone.
  std::vector<std::filesystem::path> Missing() const;

 private:
  bool any_ = false;
  std::map<std::filesystem::path, nlohmann::ordered_json> lines_;
};

}  // namespace evalbus::results
