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
// own draws nothing, and the remark states the reason. Episodes that look alike share one text, since making
// it takes as long as all other messages of a short episode.
class SceneSource {
 public:
  std::shared_ptr<const std::string> Of(const model_info_t& model, std::optional<int64_t> seed,
                                        const std::filesystem::path& run);
  // Of the last call; empty: its model is there.
  const std::string& remark() const { return remark_; }

 private:
  results::Scenes scenes_;
  // What was made last, and of what.
  std::string made_of_;
  std::shared_ptr<const std::string> entities_;
  std::string remark_;
};

struct EncodedEpisode {
  std::vector<Topic> topics;
  // By time; of equal times in the log's order.
  std::vector<Message> messages;
  // What a reader has to know, a sentence each: damage in the log, no scene.
  std::vector<std::string> remarks;
};

// The last episode of a log, its last attempt. `scenes` may be that of other logs, too. Throws InputError:
// cannot be read, or holds no episode.
EncodedEpisode EncodeEpisode(const std::filesystem::path& log, SceneSource* scenes);

// Its images as a camera sees them, 10 a second of simulated time: foxglove.CompressedImage (JPEG) on
// "/camera/NAME". size as of `evalbus render`. Throws InputError, EnvironmentError.
void AddImages(const std::filesystem::path& log, const std::vector<std::string>& cameras,
               const std::string& size, EncodedEpisode* episode);

// An MCAP file of it.
std::string McapFile(const EncodedEpisode& episode);

}  // namespace evalbus::tools
