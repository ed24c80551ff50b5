// Prints the output of `evalbus run`: a line per finished episode and, on a terminal, the live state of the
// current episode.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metrics/statistics/run_statistics.h"
#include "runner/run_controller.h"
#include "viz/watch/run_watch.h"

namespace evalbus::runner {

struct LiveHeader {
  std::string task, variation, policy, clock;
  double control_hz = 0;
  int64_t seed = 0;
  int episodes = 0;
  // Number of episodes that had finished before the run was resumed. They are reported first, through
  // OnEpisodeDone(). Their lines are printed unless tells_those_before is false.
  int there_before = 0;
  bool tells_those_before = true;
  // True if an operator judges the episodes. No results are then shown.
  bool is_blind = false;
};

class LiveView : public RunListener {
 public:
  using Clock = std::function<SteadyTime()>;

  // Draws the live state if `out` is a terminal; otherwise prints only plain lines.
  LiveView(FILE* out, const LiveHeader& header, Clock clock = std::chrono::steady_clock::now);
  ~LiveView() override { Finish(); }

  void OnEpisodeBegin(const episode_begin_t& begin) override;
  void OnPartial(const partial_metrics_t& partial) override;
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override { Print(text); }

  // Redraws at most ten times per second of wall time. Prints a line if the next episode of a source has not
  // begun a few seconds after the last one ended.
  void Poll(SteadyTime now) override;
  // Erases the live lines.
  void Finish();

  // Returns the live lines for a terminal of this width, without color codes.
  std::vector<std::string> Lines(int width, SteadyTime now);

 private:
  bool has_scores() const { return is_running_ && watch_.has_scores(); }
  double Progress() const;
  std::vector<std::string> LinesThatFit(SteadyTime now);
  // Replaces the previous live lines by `live`, and prints `above`, if it is not empty, above them.
  void Draw(const std::string& above, const std::vector<std::string>& live);
  void Print(const std::string& line);
  // Prints text, which may contain color codes, above the live lines.
  void PrintAbove(const std::string& printable);

  FILE* out_;
  bool is_terminal_, colors_;
  LiveHeader header_;
  Clock clock_;
  SteadyTime started_;
  SteadyTime drawn_{};
  int drawn_lines_ = 0;
  // The current episode if this process runs it. Episodes of workers are not shown live.
  viz::RunWatch watch_;
  bool is_running_ = false;
  // Time of the last episode's end, until the source's next episode begins or the line about it is printed.
  std::optional<SteadyTime> waiting_since_;
  metrics::RunStatistics statistics_;
  // Summary of statistics_; nullopt if the next redraw must compute it again.
  std::optional<metrics::RunSummary> summary_;
  int num_episodes_ = 0, num_successes_ = 0;
  // Success rate after each judged episode, in the order in which the episodes finished.
  std::vector<double> running_rate_;
  // Simulated duration of finished episodes, for the estimate of the remaining time.
  double simulated_s_ = 0;
};

}  // namespace evalbus::runner
