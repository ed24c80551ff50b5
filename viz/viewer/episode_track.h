// Collects one attempt of an episode from its messages: poses, scores, contacts and conditions per tick, and
// events. Produces the blocks "episode" and "ticks" of docs/viewer_data.md, and the curves and events of
// reports. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evalbus/contacts_t.hpp"
#include "evalbus/criteria_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/model_names.h"
#include "viz/viewer/block.h"
#include "viz/viewer/curves.h"
#include "viz/viewer/grasp_watch.h"

namespace evalbus::viz {

// An event. Gripper and object are empty if they are unknown or if the event concerns none.
struct TrackEvent {
  enum class Kind {
    kStage,
    kSlip,
    kGrasp,
    kRelease,
    kCollision,
    kSelfCollision,
    kLimit,
    kNoReturn,
    kCause,
    kEnd
  };
  Kind kind = Kind::kEnd;
  int64_t tick = 0;
  double time = 0;  // s of simulated time since tick 0
  std::string text;
  std::string gripper, object;
  double duration = 0;  // s; set for a grasp that has ended
};
// Returns the name of a kind in files and in the browser's data, such as "stage" or "self_collision".
const char* Word(TrackEvent::Kind kind);

class EpisodeTrack {
 public:
  // Data that the episode's messages do not contain.
  struct About {
    int run = 0;
    std::string policy = {};
    // Id and moving bodies of the SceneBlocks. Empty: the page shows no 3D image.
    std::string scene = {};
    std::vector<int> bodies = {};
    // Limit on the total size of camera images. Whenever it is exceeded, every second image is dropped.
    size_t image_bytes = kMaxImageBytes;
  };
  static constexpr size_t kMaxImageBytes = size_t{8} << 20;

  // Resolution of transmitted positions, m. The maximum error is half of it.
  static constexpr double kPositionStep = 2e-5;
  // Maximum number of ticks. Further ticks are dropped, and the block is marked as cut (is_cut).
  static constexpr int64_t kMaxTicks = 200'000;

  // Throws InputError if MODEL is inconsistent.
  EpisodeTrack(std::shared_ptr<const model_info_t> model, const header_t& episode, About about);

  // Processes a message. Ignores messages of another episode or attempt, repeated messages, and STATE and
  // CONTACTS that do not match MODEL or whose positions or directions are not finite. appearance:
  // SceneBlocks::Appearance() for this seed.
  void Receive(const episode_begin_t& begin, nlohmann::ordered_json appearance = nullptr);
  void Receive(const state_t& state);
  void Receive(const contacts_t& contacts);
  void Receive(const partial_metrics_t& partial);
  void Receive(const criteria_t& criteria);
  void Receive(const episode_end_t& end);
  void Receive(const episode_summary_t& summary);
  // Processes an image of a source's camera, which the sim has forwarded.
  void Receive(const image_t& image);
  // Adds the last tick from which the expert succeeds, an event that the messages do not contain.
  void AddNoReturn(int64_t tick, const std::string& text) { no_return_ = {tick, text}; }

  const model_info_t& model() const { return *model_; }
  const header_t& episode() const { return episode_; }
  bool IsOurs(const header_t& header) const {
    return header.episode == episode_.episode && header.attempt == episode_.attempt;
  }
  // Returns whether the STATE of this tick has been received.
  bool has_tick(int64_t tick) const { return Find(tick) && Find(tick)->has_state; }
  // Null until EPISODE_SUMMARY has been received.
  const episode_summary_t* summary() const { return summary_ ? &*summary_ : nullptr; }
  bool is_over() const { return end_.has_value() || summary_.has_value(); }

  // Returns the number of ticks that can be output, because no further messages are expected for them.
  int64_t ticks() const;
  // Returns the version of the data on which "ticks" blocks depend. If it changes, the whole episode must be
  // output again.
  int layout() const { return layout_; }

  std::string EpisodeBlock() const;
  // Returns a "ticks" block with the ticks from `from` to ticks() - 1.
  std::string TicksBlock(int64_t from) const;

  const CurveTable& curves() const { return curves_; }
  // Returns the value of a row at a tick in SI units; NaN if unavailable.
  double Value(size_t row, int64_t tick) const;
  // Returns the time of the tick, s.
  double Time(int64_t tick) const;
  // Returns the events sorted by time. The end of the episode is last. Contacts of the same pair within 0.1 s
  // are merged into one event.
  std::vector<TrackEvent> Events() const;

 private:
  struct Contact {
    uint16_t a, b;
    std::array<float, 3> position;
    std::array<int16_t, 3> normal;
    float depth;
  };
  struct Tick {
    bool has_state = false, has_contacts = false;
    // For each body in bodies_: position in units of kPositionStep, and quaternion in units of 1 / 32767.
    std::vector<std::array<int32_t, 3>> position;
    std::vector<std::array<int16_t, 4>> quat;
    std::vector<double> opening;
    double clearance = std::numeric_limits<double>::quiet_NaN();
    std::array<float, 6> clearance_points{};
    std::array<int16_t, 2> clearance_geoms{};
    std::vector<Contact> contacts;
    // Result of GraspWatch::Pinched() for this tick.
    std::vector<uint16_t> pinched;
    // One value per row of curves_.
    std::vector<double> values;
  };
  struct Image {
    size_t camera;
    // Index among the images of its camera.
    int64_t number;
    int64_t tick;
    // Value of ticks() when the image arrived. The image is part of each "ticks" block that begins at or
    // before this tick.
    int64_t known_ticks;
    std::vector<uint8_t> jpeg;
  };
  struct CriteriaAt {
    int64_t tick;
    std::vector<float> value;
    std::vector<uint8_t> holds;
  };

  // Returns null if the tick is not kept.
  Tick* At(const header_t& header);
  const Tick* Find(int64_t tick) const;
  void Fill(Tick* tick, const partial_metrics_t* partial);
  void WatchScores(const partial_metrics_t& before, const partial_metrics_t& now);
  void WatchTouches(const contacts_t& contacts);
  // Appends a grasp and, if it has ended, the release. scored_tick: last tick that the metrics used.
  void AddGrasp(const std::string& gripper, const std::string& object, int64_t first_tick, int64_t last_tick,
                int64_t scored_tick, std::vector<TrackEvent>* events) const;
  TrackEvent MakeEvent(TrackEvent::Kind kind, int64_t tick, std::string text) const;
  void AddHead(nlohmann::ordered_json* head) const;
  void AddChanging(nlohmann::ordered_json* head) const;
  void AddArrays(int64_t from, BlockWriter* block) const;
  void AddImages(int64_t from, BlockWriter* block) const;
  nlohmann::ordered_json CriteriaJson() const;
  nlohmann::ordered_json CriteriaTrees() const;

  std::shared_ptr<const model_info_t> model_;
  ModelNames names_;
  header_t episode_;
  About about_;
  std::optional<episode_begin_t> begin_;
  nlohmann::ordered_json appearance_;
  // One entry per tick; null if no message of the tick has been kept.
  std::vector<std::unique_ptr<Tick>> ticks_;
  bool is_cut_ = false;
  int layout_ = 0;
  CurveTable curves_;
  // The PARTIAL with the latest tick.
  std::optional<partial_metrics_t> partial_;
  // The first CRITERIA that was received, and all CRITERIA by tick.
  std::optional<criteria_t> criteria_;
  nlohmann::ordered_json criteria_joined_;
  std::vector<CriteriaAt> criteria_at_;
  std::optional<episode_end_t> end_;
  std::optional<std::pair<int64_t, std::string>> no_return_;
  std::optional<episode_summary_t> summary_;
  // Names of the source's cameras, and the number of images that were received from each.
  std::vector<std::string> cameras_;
  std::vector<int64_t> num_images_;
  std::vector<Image> images_;
  size_t image_bytes_ = 0;
  // Every n-th image of each camera is kept, where n is image_stride_.
  int64_t image_stride_ = 1;

  std::vector<TrackEvent> slips_, touches_;
  GraspWatch grasps_;
  std::map<std::pair<int, int>, int64_t> last_touch_us_;  // key: pair of geoms
  int64_t last_contacts_ = -1;
};

}  // namespace evalbus::viz
