// Encodes a recorded episode for external tools.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bus/event_log.h"
#include "export/encoder.h"
#include "report/episode_tracks.h"

namespace evalbus::exports {

// Implements Encoder::SceneOf. Reads the model files from the run folder `run` or, if that is empty, from the
// paths in MODEL. If a model file is missing or does not match its hash, there is no scene, and remark()
// states the reason. Consecutive episodes with the same appearance share one text, because generating the
// text takes as long as all other messages of a short episode.
class SceneSource {
 public:
  std::shared_ptr<const std::string> Of(const model_info_t& model, std::optional<int64_t> seed,
                                        const std::filesystem::path& run);
  // Returns the reason why the last call of Of() returned no scene; empty if it returned a scene.
  const std::string& remark() const { return remark_; }

 private:
  report::Scenes scenes_;
  // made_of_: key for which the latest text, entities_, was generated.
  std::string made_of_;
  std::shared_ptr<const std::string> entities_;
  std::string remark_;
};

struct EncodedEpisode {
  std::vector<Topic> topics;
  // Messages ordered by time. Messages with equal times are in the log's order.
  std::vector<Message> messages;
  // Notes on the recording, one sentence each: damage in the log, missing scene.
  std::vector<std::string> remarks;
};

// Encodes the last attempt of a log's episode. `scenes` may be shared by several logs. Throws InputError if
// the log cannot be read, or contains no episode or several episodes.
EncodedEpisode EncodeEpisode(const std::filesystem::path& log, SceneSource* scenes);

// Adds camera images, at most 10 per simulated second: foxglove.CompressedImage (JPEG) on "/camera/NAME".
// `size` has the format of the option of `evalbus render`. Throws InputError, for example if the log has no
// MODEL or EPISODE_BEGIN, and EnvironmentError.
void AddImages(const std::filesystem::path& log, const std::vector<std::string>& cameras,
               const std::string& size, EncodedEpisode* episode);

// Returns the episode as an MCAP file.
std::string McapFile(const EncodedEpisode& episode);

}  // namespace evalbus::exports
