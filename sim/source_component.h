// Replaces the sim in a run with an external simulator or a robot (docs/watch.md). Answers its
// SOURCE_ANNOUNCEMENT with MODEL, converts its SOURCE_STATEs to STATE, and runs episodes over the bus as the
// sim does (docs/messages.md). A source cannot be slowed down, so its samples are queued here. STATE(k+1) is
// published when PARTIAL(k) has arrived and no component exceeds its lag window; after a gap, some ticks are
// published without waiting for PARTIAL.
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

#include "bus/wait.h"
#include "sim/episode_component.h"
#include "sim/measured_scene.h"
#include "sim/named_contacts.h"
#include "sim/sample_ticks.h"
#include "sim/source_map.h"

namespace evalbus::sim {

// Throws InputError if the options name grippers, joints or objects that the task does not have, so that a
// launcher can check them before it starts the source's process.
void CheckSourceOptions(const SimOptions& options, const model_info_t& info);

class SourceComponent : public EpisodeComponent {
 public:
  // Also throws InputError for invalid options of the source.
  SourceComponent(Bus* bus, SimOptions options);

  void Poll(SteadyTime now) override;

 private:
  // A queued SOURCE_STATE or image, or the record that one was refused.
  struct Arrived {
    // Index among the source's episodes, in the order of arrival.
    int64_t episode;
    // The converted sample; nullopt for an image or a refused sample.
    std::optional<Sample> sample{};
    // Sample number assigned by the source, and the reason for a refusal.
    int64_t number = 0;
    std::string fault{};
    // Number of samples missing directly before this one.
    int64_t lost = 0;
    bool is_last = false;
    // Describes a joint of an object that is beyond its soft limits. Empty if there is none.
    std::string beyond_range{};
    // An image of the source's cameras. Its header contains the time since the episode's first sample. If it
    // has no bytes, the image was refused for the reason in `fault`.
    std::shared_ptr<image_t> image{};
  };
  // The active episode.
  struct Running {
    Running(int64_t its_episode, double tick_s, double its_period_s)
        : episode(its_episode), period_s(its_period_s), ticks(tick_s, its_period_s) {}
    int64_t episode;  // as in Arrived
    double period_s;  // as announced
    SampleTicks ticks;
    bool after_refused = false;
    // True if no more samples of this episode are accepted: the source has ended it, begun another one, or
    // been silent for source_timeout_s.
    bool is_over = false;
    // Last published state, and last scored tick.
    std::optional<state_t> state;
    // Contacts of this state, if the source provides them.
    contacts_t contacts{};
    int64_t scored_tick = -1;
    // First tick after a gap. Until this tick is scored, the metrics process waits for the missing ticks.
    int64_t behind_gap = -1;
    // Simulated time of the first success.
    std::optional<int64_t> success_us;
    int64_t refused = 0, lost = 0, refused_images = 0, beyond_range = 0;
    std::string first_fault, first_image_fault, first_beyond_range;

    bool is_in_gap() const { return scored_tick < behind_gap; }
    bool is_scored() const { return state && scored_tick >= state->header.tick; }
    // States the time between consecutive samples that are too far apart, and the announced period.
    std::string SparseText() const;
    // Returns a description of the faults of its samples, and counts joints beyond their limits. Empty if
    // there are none.
    std::string Faults() const;
  };
  // State of the source's newest episode, as received so far.
  struct Arriving {
    int32_t number = 0;
    int64_t sample = -1;
    std::optional<int64_t> first_stamp_us;
    int64_t stamp_us = 0;
    bool is_over = false;
    // Time of each camera's last image, since the episode's first sample.
    std::map<std::string, int64_t> image_us{};
  };

  void OnAnnouncement(const source_announcement_t& announcement);
  void OnCommand(const command_t& command);
  void OnStatus(const component_status_t& status);
  void OnSample(const source_state_t& message);
  // Throws InputError if the stamps of the first samples, which took this long, are not in microseconds.
  void CheckUnitOfStamps(int64_t samples, double time_s) const;
  void OnContacts(const source_contacts_t& contacts);
  void OnImage(std::string_view channel, std::span<const uint8_t> data);
  void OnPartial(const partial_metrics_t& partial);
  void OnForeign(const std::string& what) override;

  // Returns the announced quantities by the task's names. Throws InputError if options_.map has a name that
  // the source does not announce.
  Measured NamesOf(const source_announcement_t& announcement, const std::string& name);
  // Throws InputError if the announcement does not fit the task.
  void Meet(const source_announcement_t& announcement);
  void BeginIfMet();
  // Returns a description of what is wrong with a sample of the newest episode, or with an image. Empty if it
  // is valid.
  std::string FaultOf(const source_state_t& message, Sample* sample) const;
  // Adds the contacts that the source published with this sample. Returns a description of what is wrong with
  // them; empty if they are valid.
  std::string TakeContacts(const source_state_t& message, Sample* sample);
  std::string FaultOf(const image_t& image, std::string_view channel);
  void Arrive(Arrived arrived);
  // Handles queued samples, publishes states that are ready, and ends the episode if it is complete.
  void Advance();
  void ProcessArrived();
  void ProcessImage(const Arrived& arrived);
  bool MayPublish() const;
  void PublishState(const SampleTicks::Tick& tick);
  // Publishes the source's contacts, if it has any, and then the running episode's STATE.
  void SendState();
  bool TimeIsUp() const;
  void EndInTime();
  void CheckAnswerTimeouts(SteadyTime now);
  // lacks_tick: an expected tick did not arrive, which makes the episode incomplete.
  void End(std::string reason, std::string detail = "", bool lacks_tick = false);
  std::string source() const { return prepared_.info.source; }
  int64_t TimeOf(int64_t tick) const { return TickUs(tick, tick_s_); }
  int64_t sim_time_us() const override {
    return running_ && running_->state ? running_->state->header.sim_time_us : 0;
  }

  SimOptions options_;
  const double tick_s_;
  // Fixed opening of each gripper that is not measured; nullopt for a measured gripper.
  std::vector<std::optional<double>> opening_;
  const bool has_contacts_;
  const std::optional<SourceMap> map_;
  // Conversions of the source's joints and objects, in the order of its announcement.
  std::vector<JointMap> joint_maps_;
  std::vector<Pose> object_frames_;
  std::optional<NamedContacts> names_;
  // Last SOURCE_CONTACTS, until its sample arrives.
  std::optional<source_contacts_t> contacts_;
  // Set once the source's SOURCE_ANNOUNCEMENT has been received.
  std::unique_ptr<MeasuredScene> scene_;
  std::optional<source_announcement_t> source_announcement_;
  std::vector<uint8_t> source_announcement_bytes_;

  std::optional<command_t> command_;

  // Indices of the source's episodes, counted from 0: the newest one received, and the last finished one.
  int64_t newest_episode_ = -1, finished_ = -1;
  std::optional<Arriving> newest_;
  std::deque<Arrived> arrived_;
  // Size of the images in arrived_.
  size_t waiting_image_bytes_ = 0;
  // Cameras that have published an image, at most kMaxCameras.
  std::set<std::string> cameras_;
  // True if samples were dropped because the queue was full.
  bool overflowed_ = false;
  // silence_: time since the source's last SOURCE_STATE. unscored_: time since the last tick was published.
  Wait silence_{SteadyTime{}}, unscored_{SteadyTime{}};
  std::optional<Running> running_;
  bool unknown_told_ = false;
  bool unit_is_checked_ = false;
};

}  // namespace evalbus::sim
