#include "export/recording.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/base64.h"
#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/episode_reader.h"
#include "export/mcap_writer.h"
#include "export/scene.h"
#include "export/schemas.h"
#include "models/physics_model.h"
#include "viz/images/jpeg.h"
#include "viz/images/renderer.h"
#include "viz/images/video.h"

namespace evalbus::exports {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kImagePeriod_us = 100'000;

// Throws InputError if the log has messages of several episodes, for example a recording by lcm-logger.
void CheckHasOneEpisode(const fs::path& log) {
  EpisodeReader reader(log, {});
  std::optional<int> first;
  for (EpisodeMessages read; reader.Next(&read);) {
    if (first && read.number() != *first) {
      throw InputError(fmt::format("{}: holds several episodes ({}, {} ...); expected a log of one episode",
                                   log.string(), *first, read.number()));
    }
    first = read.number();
  }
}

}  // namespace

std::shared_ptr<const std::string> SceneSource::Of(const model_info_t& model, std::optional<int64_t> seed,
                                                   const fs::path& run) {
  remark_.clear();
  try {
    // The model's path is RUN/model/visual.mjb.
    const viz::SceneBlocks& scene =
        scenes_.Of(model, run.empty() ? fs::path(model.visual_file).parent_path().parent_path() : run);
    const nlohmann::ordered_json appearance = seed ? scene.Appearance(*seed) : nullptr;
    if (std::string made_of = scene.id() + ToText(appearance); !entities_ || made_of != made_of_) {
      entities_ = std::make_shared<const std::string>(ToText(SceneEntities(scene, appearance)));
      made_of_ = std::move(made_of);
    }
    return entities_;
  } catch (const InputError& error) {
    remark_ = fmt::format("no scene: {}", error.what());
    return nullptr;
  }
}

EncodedEpisode EncodeEpisode(const fs::path& log, SceneSource* scenes) {
  CheckHasOneEpisode(log);
  EncodedEpisode episode;
  const fs::path run = RunFolderOf(log);
  std::string remark;
  Encoder encoder([&](const Message& message) { episode.messages.push_back(message); },
                  [&](const model_info_t& model, std::optional<int64_t> seed) {
                    auto entities = scenes->Of(model, seed, run);
                    if (!scenes->remark().empty()) remark = scenes->remark();
                    return entities;
                  });
  EventLogReader reader(log);
  for (LogEvent event; reader.Next(&event);) {
    const int64_t attempts = encoder.num_attempts();
    const auto num_before = static_cast<std::ptrdiff_t>(episode.messages.size());
    encoder.Receive(event.channel, event.data);
    // A new attempt begins with this event; only the last one is kept.
    if (encoder.num_attempts() > attempts)
      episode.messages.erase(episode.messages.begin(), episode.messages.begin() + num_before);
  }
  if (episode.messages.empty()) throw InputError(log.string() + ": no episode in this log");
  std::ranges::stable_sort(episode.messages, {}, &Message::time_ns);
  episode.topics = encoder.topics();
  if (!remark.empty()) episode.remarks.push_back(remark);
  if (reader.damaged_bytes() > 0) {
    episode.remarks.push_back(
        fmt::format("{}: skipped {}", log.string(), Plural(reader.damaged_bytes(), "damaged byte")));
  }
  if (encoder.undecodable() > 0) {
    episode.remarks.push_back(
        fmt::format("{}: skipped {}", log.string(), Plural(encoder.undecodable(), "undecodable message")));
  }
  return episode;
}

void AddImages(const fs::path& log, const std::vector<std::string>& cameras, const std::string& size,
               EncodedEpisode* episode) {
  EpisodeReader reader(log, {channels::kState});
  EpisodeMessages last;
  for (EpisodeMessages read; reader.Next(&read);) last = std::move(read);
  if (!last.model || !last.begin) {
    throw InputError(log.string() + ": images cannot be rendered: no complete MODEL and EPISODE_BEGIN");
  }
  const size_t first = episode->topics.size();
  for (const std::string& camera : cameras) {
    episode->topics.push_back({"/camera/" + camera, "foxglove.CompressedImage", CompressedImageSchema()});
  }
  viz::Frame frame(viz::ParseFrameSize(size));
  UseModelsIn(RunFolderOf(log), &*last.model);
  viz::Renderer renderer(LoadVisualModel(*last.model), frame.size);
  viz::CheckCameras(renderer.model(), cameras);
  renderer.SetAppearance(*last.model, last.begin->seed);
  std::vector<Message> images;
  viz::JpegEncoder jpeg;
  int64_t next_us = 0;
  for (const state_t& state : last.states) {
    if (state.header.sim_time_us < next_us) continue;
    next_us = state.header.sim_time_us + kImagePeriod_us;
    renderer.SetState(state);
    const int64_t time = state.header.sim_time_us * 1000;
    for (size_t k = 0; k < cameras.size(); ++k) {
      renderer.Render(viz::FindCamera(renderer.model(), cameras[k]), &frame);
      const nlohmann::ordered_json json = {{"timestamp", TimeJson(time)},
                                           {"frame_id", cameras[k]},
                                           {"data", Base64(jpeg.Encode(frame))},
                                           {"format", "jpeg"}};
      images.push_back({first + k, time, std::make_shared<const std::string>(ToText(json))});
    }
  }
  episode->messages.insert(episode->messages.end(), images.begin(), images.end());
  std::ranges::stable_sort(episode->messages, {}, &Message::time_ns);
}

std::string McapFile(const EncodedEpisode& episode) {
  McapWriter writer("evalbus");
  for (const Topic& topic : episode.topics) writer.AddChannel(topic.name, topic.schema_name, topic.schema);
  for (const Message& message : episode.messages) {
    writer.Add(static_cast<uint16_t>(message.topic), message.time_ns, *message.json);
  }
  return writer.Finish();
}

}  // namespace evalbus::exports
