#include "runner/json_events.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "base/errors.h"
#include "base/json_file.h"
#include "metrics/episode/result_json.h"

namespace evalbus::runner {
namespace {

using nlohmann::ordered_json;

constexpr char kEpisode[] = "episode";

std::string Line(const char* event, const ordered_json& content) {
  ordered_json line = {{"schema_version", kEventsVersion}, {"event", event}};
  line.update(content);
  return ToText(line) + "\n";
}

const char* VerdictWord(int8_t verdict) {
  return verdict == partial_metrics_t::SUCCESS   ? "success"
         : verdict == partial_metrics_t::FAILURE ? "failure"
                                                 : "undecided";
}

}  // namespace

std::vector<std::string> RunOutput::JsonOptions() const {
  std::vector<std::string> options;
  if (json) options.emplace_back("--json");
  if (partial_hz > 0) options.insert(options.end(), {"--partial-hz", fmt::format("{}", partial_hz)});
  return options;
}

void EventLines::Write(const char* event, const ordered_json& content) {
  output_.Write(Line(event, content));
}

void EventLines::Relay(const std::string& line) {
  const std::string text = Line(kEpisode, ordered_json::object());
  const bool is_episode = line.starts_with(text.substr(0, text.find('}')));
  if (is_episode && !relayed_.insert(std::hash<std::string>()(line)).second) return;
  output_.Write(line + "\n");
}

void EventLines::CheckReader() const {
  if (!output_.has_reader())
    throw EnvironmentError("stopped: the reader of standard output (--json) has exited");
}

void JsonEvents::Begin(const ordered_json& names, const ordered_json& facts) {
  names_ = names;
  Write("begin", facts);
}

void JsonEvents::Write(const char* event, const ordered_json& content) {
  ordered_json all = names_;
  all.update(content);
  lines_.Write(event, all);
}

void JsonEvents::OnEpisodeBegin(const episode_begin_t& begin) {
  Write("episode_begin", {{"episode", begin.header.episode}, {"seed", begin.seed}});
  partial_period_ = -1;
  next_->OnEpisodeBegin(begin);
}

void JsonEvents::OnPartial(const partial_metrics_t& partial) {
  const double time_s = static_cast<double>(partial.header.sim_time_us) / 1e6;
  if (const int64_t period = std::llround(std::floor(time_s * partial_hz_ + 1e-9));
      partial_hz_ > 0 && period > partial_period_) {
    partial_period_ = period;
    Write("partial", {{"episode", partial.header.episode},
                      {"tick", partial.header.tick},
                      {"time_s", time_s},
                      {"verdict", VerdictWord(partial.verdict)},
                      {"metrics", metrics::ResultJson(partial.metrics)},
                      {"extended", metrics::ExtendedJson(partial.extended, partial.metrics)}});
  }
  next_->OnPartial(partial);
}

void JsonEvents::OnEpisodeDone(const ordered_json& episode) {
  Write(kEpisode, {{"result", episode}});
  next_->OnEpisodeDone(episode);
}

void JsonEvents::OnRemark(const std::string& text) {
  Write("remark", {{"text", text}});
  next_->OnRemark(text);
}

void JsonEvents::Poll(SteadyTime now) {
  lines_.CheckReader();
  next_->Poll(now);
}

}  // namespace evalbus::runner
