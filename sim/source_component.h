// The sim's place in a run of somebody else's simulator or robot (docs/watch.md): answers its
// SOURCE_ANNOUNCEMENT with MODEL, makes STATE of its SOURCE_STATEs, and runs episodes over the bus as the sim
// does (docs/messages.md). Nobody can hold a source back: its samples wait here, and STATE(k+1) is published
// when PARTIAL(k) is there and no windowed consumer lags too far.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/component.h"
#include "bus/repeater.h"
#include "bus/wait.h"
#include "sim/measured_scene.h"
#include "sim/readiness_tracker.h"
#include "sim/sample_ticks.h"

namespace evalbus::sim {

class SourceComponent : public Component {
 public:
  // Composes and compiles the scene, writes the models. Throws InputError.
  SourceComponent(Bus* bus, SimOptions options);

  void Poll(SteadyTime now) override;
  bool done() const override { return done_; }

 private:
  enum class Phase {
    kIdle,     // between episodes
    kWaiting,  // EPISODE_BEGIN is out, not everybody is ready
    kRunning,  // all are ready; the source's next episode is this one
  };
  // A SOURCE_STATE or an image that waits, or what is left of one that was refused.
  struct Arrived {
    // Of the source's episodes, in the order in which they came.
    int64_t episode;
    // Nothing: refused, or an image.
    std::optional<Sample> sample{};
    // The source's number of it, and why it was refused.
    int64_t number = 0;
    std::string fault{};
    // Those before it that never came.
    int64_t lost = 0;
    bool is_last = false;
    // An image of the source's cameras; its header has the time since the episode's first sample. Without
    // bytes: it was refused, and `fault` says why.
    std::shared_ptr<image_t> image{};
  };
  // The episode that goes on.
  struct Running {
    Running(int64_t its_episode, double tick_s, double period_s)
        : episode(its_episode), ticks(tick_s, period_s) {}
    int64_t episode;  // as in Arrived
    SampleTicks ticks;
    bool after_refused = false;
    // The source has ended it, or begun another one.
    bool is_over = false;
    // The last that was published, and scored.
    std::optional<state_t> state;
    int64_t scored_tick = -1;
    // The first tick behind a gap: until it is scored, metrics waits for what does not come.
    int64_t behind_gap = -1;
    // Simulated time of the first success.
    std::optional<int64_t> success_us;
    int64_t refused = 0, lost = 0, refused_images = 0;
    std::string first_fault, first_image_fault;

    bool is_in_gap() const { return scored_tick < behind_gap; }
    bool is_scored() const { return state && scored_tick >= state->header.tick; }
    // What was wrong with its samples; empty where nothing was.
    std::string Faults() const;
  };
  // Of the source's newest episode to come, what came of it.
  struct Arriving {
    int32_t number = 0;
    int64_t sample = -1;
    std::optional<int64_t> first_stamp_us;
    int64_t stamp_us = 0;
    bool is_over = false;
    // When the last image of each camera was taken, since the episode's first sample.
    std::map<std::string, int64_t> image_us{};
  };

  void OnAnnouncement(const source_announcement_t& announcement);
  void OnCommand(const command_t& command);
  void OnStatus(const component_status_t& status);
  void OnSample(const source_state_t& message);
  void OnImage(std::string_view channel, std::span<const uint8_t> data);
  void OnPartial(const partial_metrics_t& partial);
  void OnOwnModel();
  void OnOwnBegin(const episode_begin_t& begin);

  // Throws InputError for what does not fit the task.
  void Meet(const source_announcement_t& announcement);
  void BeginIfMet();
  void AnnounceEpisode();
  void PublishModel();
  // Of a sample, in an episode that has begun; empty: the sample is good.
  std::string FaultOf(const source_state_t& message, Sample* sample) const;
  std::string FaultOf(const image_t& image, std::string_view channel);
  void Arrive(Arrived arrived);
  // Takes what has come, publishes what may be, ends what is over.
  void Advance();
  void TakeArrived();
  void TakeImage(const Arrived& arrived);
  bool MayPublish() const;
  void PublishState(const SampleTicks::Tick& tick);
  bool TimeIsUp() const;
  void EndInTime();
  void CheckAnswerTimeouts(SteadyTime now);
  // lacks_tick: one that should have come did not, which makes the episode incomplete.
  void End(std::string reason, std::string detail = "", bool lacks_tick = false);
  std::string source() const { return prepared_.info.source; }
  int64_t TimeOf(int64_t tick) const { return TickUs(tick, tick_s_); }

  SimOptions options_;
  PreparedScene prepared_;
  const double tick_s_;
  // By gripper: how far it is open all the time, where nobody measures it.
  std::vector<std::optional<double>> opening_;
  // Of the source, once its SOURCE_ANNOUNCEMENT was heard.
  std::unique_ptr<MeasuredScene> scene_;
  std::optional<source_announcement_t> source_announcement_;
  std::vector<uint8_t> source_announcement_bytes_;
  std::vector<uint8_t> model_bytes_;

  Phase phase_ = Phase::kIdle;
  bool done_ = false;
  std::optional<command_t> command_;
  episode_begin_t begin_{};
  episode_end_t end_{};
  ReadinessTracker readiness_;

  // Of the source's episodes, counted from 0: the newest to come, and the last that is finished with.
  int64_t newest_episode_ = -1, finished_ = -1;
  std::optional<Arriving> newest_;
  std::deque<Arrived> arrived_;
  // Of the images in it.
  size_t waiting_image_bytes_ = 0;
  // Names of the cameras that have published, at most kMaxCameras.
  std::set<std::string> cameras_;
  // Samples were dropped, since there are too many.
  bool overflowed_ = false;
  // Since the source has said something; since the tick that is out waits for its score.
  Wait silence_{SteadyTime{}}, unscored_{SteadyTime{}};
  std::optional<Running> running_;
  bool unknown_told_ = false;

  Repeater announcement_, model_, unheard_state_, unheard_end_;
  int64_t model_published_sim_us_ = 0;
};

}  // namespace evalbus::sim
