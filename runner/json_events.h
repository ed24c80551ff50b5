// Implements `evalbus run --json`, which writes the events of a run or suite to standard output, one JSON
// object per line (docs/schema/event.json).
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

// Output of a run. json: prints events, and writes readable text to standard error. quiet: prints no readable
// text. partial_hz: number of events with the current score per simulated second; 0: none.
struct RunOutput {
  bool json = false, quiet = false;
  double partial_hz = 0;

  // Returns the options of `evalbus run` that make a process print these events for one run.
  std::vector<std::string> JsonOptions() const;
};

// Writes events, one per line.
class EventLines {
 public:
  // While this object exists, the run's readable text goes to standard error or, with discards_text, is
  // discarded.
  explicit EventLines(bool discards_text) : output_(discards_text) {}

  // Throws EnvironmentError.
  void Write(const char* event, const nlohmann::ordered_json& content);
  // Writes a line that the process of one run printed. A process that resumes a run repeats the lines of
  // finished episodes; these lines are omitted. Throws EnvironmentError.
  void Relay(const std::string& line);
  // Throws EnvironmentError if the program that reads the events has exited. The run then ends.
  void CheckReader() const;

 private:
  ReservedStdout output_;
  // Hashes of the lines of finished episodes that were written.
  std::set<size_t> relayed_;
};

// Writes the events of one run. Each line names the run, its policy, task and variation.
class JsonEvents : public RunListener {
 public:
  explicit JsonEvents(const RunOutput& output) : lines_(output.quiet), partial_hz_(output.partial_hz) {}

  // Also forwards all further events of the run to `next`.
  void SetNext(RunListener* next) { next_ = next; }

  // Writes the event that the run begins. names: "run", "policy", "task" and "variation", which all lines
  // contain. facts: other keys of this event.
  void Begin(const nlohmann::ordered_json& names, const nlohmann::ordered_json& facts);
  // Writes the event that the run has ended. `summary`: content of summary.json.
  void Finish(const nlohmann::ordered_json& summary) { Write("summary", {{"summary", summary}}); }

  void OnEpisodeBegin(const episode_begin_t& begin) override;
  void OnPartial(const partial_metrics_t& partial) override;
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override;
  // Also checks whether the reading program still exists.
  void Poll(SteadyTime now) override;

 private:
  void Write(const char* event, const nlohmann::ordered_json& content);

  EventLines lines_;
  double partial_hz_;
  // Index of the period of length 1 / partial_hz_ in which the last "partial" was written.
  int64_t partial_period_ = -1;
  nlohmann::ordered_json names_;
  RunListener* next_ = nullptr;
};

}  // namespace evalbus::runner
