// A recorded episode as tools are shown it: its log, encoded.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bus/event_log.h"
#include "cli/results/episode_tracks.h"
#include "cli/tools/encoder.h"

namespace evalbus::tools {

// Encoder::SceneOf for MODELs of a run in this folder; empty: where they say. A model that is gone or not its
// own draws nothing, and its remark says why, once.
class SceneSource {
 public:
  explicit SceneSource(std::filesystem::path run) : run_(std::move(run)) {}
  nlohmann::ordered_json Of(const model_info_t& model, std::optional<int64_t> seed);
  const std::string& remark() const { return remark_; }

 private:
  std::filesystem::path run_;
  results::Scenes scenes_;
  std::string remark_;
};

struct EncodedEpisode {
  std::vector<Topic> topics;
  // By time; of equal times in the log's order.
  std::vector<Message> messages;
  // What a reader has to know, a sentence each: damage in the log, no scene.
  std::vector<std::string> remarks;
};

// The last episode of a log, its last attempt. Throws InputError: cannot be read, or holds no episode.
EncodedEpisode EncodeEpisode(const std::filesystem::path& log);

// Its pictures as a camera sees them, 10 a second of simulated time: foxglove.CompressedImage (JPEG) on
// "/camera/NAME". size as of `evalbus render`. Throws InputError, EnvironmentError.
void AddPictures(const std::filesystem::path& log, const std::vector<std::string>& cameras,
                 const std::string& size, EncodedEpisode* episode);

// An MCAP file of it.
std::string McapFile(const EncodedEpisode& episode);

}  // namespace evalbus::tools
