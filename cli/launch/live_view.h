// What `evalbus run` shows: a line per finished episode, and, on a terminal, the running one live below.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/launch/run_controller.h"
#include "metrics/statistics/run_statistics.h"
#include "viz/watch/run_watch.h"

namespace evalbus::launch {

struct LiveHeader {
  std::string task, variation, policy, clock;
  double control_hz = 0;
  int64_t seed = 0;
  int episodes = 0;
  // Of them, how many were finished when the run was gone on with; told like the others, at once, or not at
  // all.
  int there_before = 0;
  bool tells_those_before = true;
};

class LiveView : public RunListener {
 public:
  using Clock = std::function<SteadyTime()>;

  // Draws live if `out` is a terminal, else prints plain lines only.
  LiveView(FILE* out, const LiveHeader& header, Clock clock = std::chrono::steady_clock::now);
  ~LiveView() override { Finish(); }

  void OnEpisodeBegin(const episode_begin_t& begin) override;
  void OnPartial(const partial_metrics_t& partial) override;
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override { Print(text); }

  // Redraws at most ten times a second of wall time.
  void Poll(SteadyTime now) override;
  // Takes the live lines away.
  void Finish();

  // The live lines for a terminal of this width; without color codes.
  std::vector<std::string> Lines(int width, SteadyTime now);

 private:
  bool has_scores() const { return is_running_ && watch_.has_scores(); }
  double Progress() const;
  std::vector<std::string> LinesThatFit(SteadyTime now);
  // Puts a line, if any, above the live lines, and these in place of those drawn before.
  void Draw(const std::string& above, const std::vector<std::string>& live);
  void Print(const std::string& line);

  FILE* out_;
  bool is_terminal_;
  LiveHeader header_;
  Clock clock_;
  SteadyTime started_;
  SteadyTime drawn_{};
  int drawn_lines_ = 0;
  // The episode under way, where it is ours and not a worker's.
  viz::RunWatch watch_;
  bool is_running_ = false;
  metrics::RunStatistics statistics_;
  // Of them; empty until it is drawn again.
  std::optional<metrics::RunSummary> summary_;
  int num_episodes_ = 0;
  // Simulated length of finished episodes, for the time left.
  double simulated_s_ = 0;
};

}  // namespace evalbus::launch
