// `evalbus run --json`: the events of a run or suite on standard output, one JSON object in each line
// (docs/schema/event.json).
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "base/reserved_stdout.h"
#include "runner/run_controller.h"

namespace evalbus::runner {

// Version of the events, and of the messages of `evalbus env`.
inline constexpr int kEventsVersion = 1;

// What a run prints. json: events; text for people then goes to standard error. quiet: no text for people.
// partial_hz: number of events with the score so far, per simulated second; 0: none.
struct RunOutput {
  bool json = false, quiet = false;
  double partial_hz = 0;

  // Options of `evalbus run` with which the process of one run prints these events.
  std::vector<std::string> JsonOptions() const;
};

// Writes events, one in each line.
class EventLines {
 public:
  // From here on, everything that the run prints for people goes to standard error, or nowhere.
  explicit EventLines(bool discards_text) : output_(discards_text) {}

  // Throws EnvironmentError.
  void Write(const char* event, const nlohmann::ordered_json& content);
  // Writes a line that the process of one run printed. A process that continues a run repeats the lines of
  // its finished episodes, which are left out. Throws EnvironmentError.
  void Relay(const std::string& line);
  // Throws EnvironmentError, which ends the run, if the program that reads the events has exited.
  void CheckReader() const;

 private:
  ReservedStdout output_;
  // Hashes of the lines of finished episodes.
  std::set<size_t> relayed_;
};

// The events of one run. Each line names the run, its policy, task and variation.
class JsonEvents : public RunListener {
 public:
  explicit JsonEvents(const RunOutput& output) : lines_(output.quiet), partial_hz_(output.partial_hz) {}

  // Forwards all events of the run to `next` from here on.
  void SetNext(RunListener* next) { next_ = next; }

  // The run starts. names: "run", "policy", "task" and "variation", for all lines. facts: other keys of this
  // event.
  void Begin(const nlohmann::ordered_json& names, const nlohmann::ordered_json& facts);
  // The run has ended. `summary`: content of summary.json.
  void Finish(const nlohmann::ordered_json& summary) { Write("summary", {{"summary", summary}}); }

  void OnEpisodeBegin(const episode_begin_t& begin) override;
  void OnPartial(const partial_metrics_t& partial) override;
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override;
  // Checks the reader, too.
  void Poll(SteadyTime now) override;

 private:
  void Write(const char* event, const nlohmann::ordered_json& content);

  EventLines lines_;
  double partial_hz_;
  // Number of the period of 1 / partial_hz_ for which the last "partial" was written.
  int64_t partial_period_ = -1;
  nlohmann::ordered_json names_;
  RunListener* next_ = nullptr;
};

}  // namespace evalbus::runner
