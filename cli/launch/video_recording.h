// Videos of a run's finished episodes, made beside it: one `evalbus render` at a time, at low priority while
// the run evaluates. One that fails or is killed is tried once more.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/launch/processes.h"
#include "cli/launch/run_controller.h"

namespace evalbus::launch {

// How `evalbus render --report-progress` reports which share of its videos is done, 0 to 1.
inline constexpr char kVideoShare[] = "render [info] videos: ";

class VideoRecording : public RunListener {
 public:
  // The command that makes the videos of an episode.
  using Render = std::function<std::vector<std::string>(int episode)>;

  // Passes everything on to `next`. Without cameras it does only that.
  VideoRecording(const results::RunFolder& folder, const std::vector<std::string>& cameras,
                 RunListener* next);
  VideoRecording(const results::RunFolder& folder, std::vector<std::string> cameras, RunListener* next,
                 Render render);
  // A video that is not finished leaves no file.
  ~VideoRecording() override;

  void OnEpisodeBegin(const episode_begin_t& begin) override { next_->OnEpisodeBegin(begin); }
  void OnPartial(const partial_metrics_t& partial) override { next_->OnPartial(partial); }
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override { next_->OnRemark(text); }
  void Poll(SteadyTime now) override;

  // Waits for the videos that are missing, or until a stop is requested, and shows how long. Returns how many
  // episodes still lack theirs. Throws EnvironmentError if one could not be made; after that, further ones
  // are only tried where it was its log that is wrong.
  size_t Finish();

 private:
  void Advance();
  void RemoveUnfinished(pid_t video) const;
  size_t Missing() const { return waiting_.size() + rendering_.has_value(); }
  // The same, less what is there of the video under way.
  double Left();

  const results::RunFolder& folder_;
  std::vector<std::string> cameras_;
  RunListener* next_;
  Render render_;
  std::deque<int> waiting_;
  std::optional<int> rendering_;
  std::set<int> tried_again_;
  // The first.
  std::string failure_;
  bool gave_up_ = false;
  bool is_beside_run_ = true;
  // What `evalbus render` says, and how far it is by that.
  results::NewLines log_;
  double share_ = 0;
  Processes processes_;
};

}  // namespace evalbus::launch
