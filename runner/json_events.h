// `evalbus run --json`: the events of a run or suite on standard output, one JSON object in each line
// (docs/schema/event.json).
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/reserved_stdout.h"
#include "runner/run_controller.h"

namespace evalbus::runner {

// Version of the events, and of the messages of `evalbus env`.
inline constexpr int kEventsVersion = 1;

// What a run prints. json: events; text for people then goes to standard error. quiet: no text for people.
struct RunOutput {
  bool json = false, quiet = false;
};

// Writes events, one in each line.
class EventLines {
 public:
  // From here on, everything that the run prints for people goes to standard error, or nowhere.
  explicit EventLines(bool discards_text) : output_(discards_text) {}

  // Throws EnvironmentError.
  void Write(const char* event, const nlohmann::ordered_json& content);
  // Throws EnvironmentError, which ends the run, if the program that reads the events has exited.
  void CheckReader() const;

 private:
  ReservedStdout output_;
};

class JsonEvents : public RunListener {
 public:
  explicit JsonEvents(bool discards_text) : lines_(discards_text) {}

  // Forwards all events of the run to `next` from here on.
  void SetNext(RunListener* next) { next_ = next; }

  // The run starts. `facts`: the event's other keys.
  void Begin(const nlohmann::ordered_json& facts) { lines_.Write("begin", facts); }
  // The run has ended. `summary`: content of summary.json.
  void Finish(const nlohmann::ordered_json& summary) { lines_.Write("summary", {{"summary", summary}}); }

  void OnEpisodeBegin(const episode_begin_t& begin) override;
  void OnPartial(const partial_metrics_t& partial) override { next_->OnPartial(partial); }
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override;
  // Checks the reader, too.
  void Poll(SteadyTime now) override;

 private:
  EventLines lines_;
  RunListener* next_ = nullptr;
};

}  // namespace evalbus::runner
