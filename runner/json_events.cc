#include "runner/json_events.h"

#include "base/errors.h"

namespace evalbus::runner {

void JsonEvents::Write(const char* event, const nlohmann::ordered_json& content) {
  nlohmann::ordered_json line = {{"schema_version", kEventsVersion}, {"event", event}};
  line.update(content);
  output_.Write(line.dump() + "\n");
}

void JsonEvents::OnEpisodeBegin(const episode_begin_t& begin) {
  Write("episode_begin", {{"episode", begin.header.episode}, {"seed", begin.seed}});
  next_->OnEpisodeBegin(begin);
}

void JsonEvents::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  Write("episode", {{"result", episode}});
  next_->OnEpisodeDone(episode);
}

void JsonEvents::OnRemark(const std::string& text) {
  Write("remark", {{"text", text}});
  next_->OnRemark(text);
}

void JsonEvents::Poll(SteadyTime now) {
  if (!output_.has_reader()) throw EnvironmentError("stopped: the reader of --json has exited");
  next_->Poll(now);
}

}  // namespace evalbus::runner
