// The folder of a run, as docs/run_folder.md describes it. A file that is there is whole: results are
// appended and synced line by line, everything else is written under another name and renamed.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace evalbus {

class RunFolder {
 public:
  // Creates the folder. Throws InputError if it exists and is not empty, or cannot be made.
  explicit RunFolder(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path log_file(const std::string& component) const {
    return path_ / "logs" / (component + ".log");
  }

  // The functions below throw EnvironmentError where the disk refuses.
  void WriteJson(const std::string& name, const nlohmann::ordered_json& json) const;
  // Writes episodes/0007/summary.json and then appends the line to episodes.jsonl.
  void AddEpisode(int episode, const nlohmann::ordered_json& result) const;
  // Removes what an unfinished attempt of an episode left.
  void DiscardEpisode(int episode) const;

 private:
  std::filesystem::path path_;
};

// runs/NAME-DATE-TIME under the current folder.
std::filesystem::path DefaultRunFolder(const std::string& name);

}  // namespace evalbus
