#include "runner/json_events.h"

#include "base/errors.h"

namespace evalbus::runner {

void EventLines::Write(const char* event, const nlohmann::ordered_json& content) {
  nlohmann::ordered_json line = {{"schema_version", kEventsVersion}, {"event", event}};
  line.update(content);
  output_.Write(line.dump() + "\n");
}

void EventLines::CheckReader() const {
  if (!output_.has_reader()) throw EnvironmentError("stopped: the reader of --json has exited");
}

void JsonEvents::OnEpisodeBegin(const episode_begin_t& begin) {
  lines_.Write("episode_begin", {{"episode", begin.header.episode}, {"seed", begin.seed}});
  next_->OnEpisodeBegin(begin);
}

void JsonEvents::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  lines_.Write("episode", {{"result", episode}});
  next_->OnEpisodeDone(episode);
}

void JsonEvents::OnRemark(const std::string& text) {
  lines_.Write("remark", {{"text", text}});
  next_->OnRemark(text);
}

void JsonEvents::Poll(SteadyTime now) {
  lines_.CheckReader();
  next_->Poll(now);
}

}  // namespace evalbus::runner
