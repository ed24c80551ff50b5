// Records videos of a run's finished episodes during the run: one `evalbus render` at a time, at low priority
// while episodes are evaluated. A render process that is killed or fails is retried once, unless the
// episode's log is invalid.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "runner/processes.h"
#include "runner/run_controller.h"

namespace evalbus::runner {

// Prefix of the lines in which `evalbus render --report-progress` reports the finished fraction, from 0 to 1.
inline constexpr char kVideoShare[] = "render [info] videos: ";

class VideoRecording : public RunListener {
 public:
  // Returns the command that renders the videos of an episode.
  using Render = std::function<std::vector<std::string>(int episode)>;

  // Forwards all events to `next`. If there are no cameras, it does nothing else. gl: renderer (--gl).
  VideoRecording(const results::RunFolder& folder, const std::vector<std::string>& cameras,
                 const std::string& gl, RunListener* next);
  VideoRecording(const results::RunFolder& folder, std::vector<std::string> cameras, RunListener* next,
                 Render render);
  // Stops rendering and removes unfinished videos.
  ~VideoRecording() override;

  void OnEpisodeBegin(const episode_begin_t& begin) override { next_->OnEpisodeBegin(begin); }
  void OnPartial(const partial_metrics_t& partial) override { next_->OnPartial(partial); }
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override { next_->OnRemark(text); }
  void Poll(SteadyTime now) override;

  // Waits for the missing videos, or until a stop is requested, and shows the progress. Returns the number of
  // episodes without videos. Throws EnvironmentError if a video could not be recorded. After a failure,
  // further videos are recorded only if the cause was that episode's log.
  size_t Finish();

 private:
  void Advance();
  void RemoveUnfinished(pid_t video) const;
  size_t Missing() const { return waiting_.size() + rendering_.has_value(); }
  // Returns Missing() minus the finished fraction of the current episode's videos.
  double Left();

  const results::RunFolder& folder_;
  std::vector<std::string> cameras_;
  RunListener* next_;
  Render render_;
  std::deque<int> waiting_;
  std::optional<int> rendering_;
  std::set<int> tried_again_;
  // Description of the first failure.
  std::string failure_;
  bool gave_up_ = false;
  bool is_beside_run_ = true;
  // Log of `evalbus render`, and the finished fraction that it last reported.
  results::NewLines log_;
  double share_ = 0;
  Processes processes_;
};

}  // namespace evalbus::runner
