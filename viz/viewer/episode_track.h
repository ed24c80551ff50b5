// One attempt of one episode, as far as it is known from its messages: poses, scores, contacts, conditions
// tick by tick, and what happened. Pure. Gives the blocks "episode" and "ticks" of docs/viewer_data.md, and
// reports their curves and events.
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

namespace evalbus::viz {

// Something that happened; what it is about is empty where that is not known (yet).
struct TrackEvent {
  enum class Kind { kStage, kSlip, kGrasp, kRelease, kCollision, kSelfCollision, kEnd };
  Kind kind = Kind::kEnd;
  int64_t tick = 0;
  double time = 0;  // s since the episode began
  std::string text;
  std::string gripper, object;
  double duration = 0;  // s
};

class EpisodeTrack {
 public:
  // What no message of the episode says.
  struct About {
    int run = 0;
    std::string policy = {};
    // As of SceneBlocks; empty: the page draws nothing.
    std::string scene = {};
    std::vector<int> bodies = {};
    // Images of a source's cameras beyond so many bytes: every second one is left out, and so on.
    size_t image_bytes = kMaxImageBytes;
  };
  static constexpr size_t kMaxImageBytes = size_t{8} << 20;

  // Positions are sent in steps of so much, m, which makes half of it the largest error.
  static constexpr double kPositionStep = 2e-5;
  // Ticks beyond so many are not kept; the block says that it is cut.
  static constexpr int64_t kMaxTicks = 200'000;

  // Throws InputError where MODEL contradicts itself.
  EpisodeTrack(std::shared_ptr<const model_info_t> model, const header_t& episode, About about);

  // Messages of another episode or attempt are not taken, nor is a tick said again, one that does not fit
  // MODEL, or has a number that is none. appearance: SceneBlocks::Appearance() of this seed.
  void Hear(const episode_begin_t& begin, nlohmann::ordered_json appearance = nullptr);
  void Hear(const state_t& state);
  void Hear(const contacts_t& contacts);
  void Hear(const partial_metrics_t& partial);
  void Hear(const criteria_t& criteria);
  void Hear(const episode_end_t& end);
  void Hear(const episode_summary_t& summary);
  // An image of a source's camera, as the sim passes it on.
  void Hear(const image_t& image);

  const model_info_t& model() const { return *model_; }
  const header_t& episode() const { return episode_; }
  bool IsOurs(const header_t& header) const {
    return header.episode == episode_.episode && header.attempt == episode_.attempt;
  }
  // STATE of this tick has come.
  bool has_tick(int64_t tick) const { return Find(tick) && Find(tick)->has_state; }
  // Null before.
  const episode_summary_t* summary() const { return summary_ ? &*summary_ : nullptr; }
  bool is_over() const { return end_.has_value() || summary_.has_value(); }

  // How many ticks can be given: those of which all has been heard that will be.
  int64_t ticks() const;
  // Changes when what "ticks" rests on does: then the whole episode has to be given anew.
  int layout() const { return layout_; }

  std::string EpisodeBlock() const;
  // The ticks from this one on, up to ticks().
  std::string TicksBlock(int64_t from) const;

  const CurveTable& curves() const { return curves_; }
  // In SI units, NaN where there is none.
  double Value(size_t row, int64_t tick) const;
  // s
  double Time(int64_t tick) const;
  // In order of time, the end last. A touch that comes back within 0.1 s is the same one.
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
    // Of bodies_: steps of kPositionStep, and / 32767.
    std::vector<std::array<int32_t, 3>> position;
    std::vector<std::array<int16_t, 4>> quat;
    std::vector<double> opening;
    double clearance = std::numeric_limits<double>::quiet_NaN();
    std::array<float, 6> clearance_points{};
    std::array<int16_t, 2> clearance_geoms{};
    std::vector<Contact> contacts;
    // By row of curves_.
    std::vector<double> values;
  };
  struct Image {
    size_t camera;
    // How manieth of its camera.
    int64_t number;
    int64_t tick;
    // ticks() when it came: blocks of ticks from there on have it.
    int64_t known_ticks;
    std::vector<uint8_t> jpeg;
  };
  struct CriteriaAt {
    int64_t tick;
    std::vector<float> value;
    std::vector<uint8_t> holds;
  };

  // Null: it is not kept.
  Tick* At(const header_t& header);
  const Tick* Find(int64_t tick) const;
  void Fill(Tick* tick, const partial_metrics_t* partial);
  void WatchScores(const partial_metrics_t& before, const partial_metrics_t& now);
  void WatchTouches(const contacts_t& contacts);
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
  // Null where nothing of a tick has come.
  std::vector<std::unique_ptr<Tick>> ticks_;
  bool is_cut_ = false;
  int layout_ = 0;
  CurveTable curves_;
  // The one of the latest tick.
  std::optional<partial_metrics_t> partial_;
  // The first that came, and all by tick.
  std::optional<criteria_t> criteria_;
  nlohmann::ordered_json criteria_joined_;
  std::vector<CriteriaAt> criteria_at_;
  std::optional<episode_end_t> end_;
  std::optional<episode_summary_t> summary_;
  // Of the source: names, and how many images of each have come.
  std::vector<std::string> cameras_;
  std::vector<int64_t> num_images_;
  std::vector<Image> images_;
  size_t image_bytes_ = 0;
  // Of each camera every so many are kept.
  int64_t image_stride_ = 1;

  std::vector<TrackEvent> scores_events_, touches_;
  std::map<std::pair<int, int>, int64_t> last_touch_us_;  // by geoms
  int64_t last_contacts_ = -1;
};

}  // namespace evalbus::viz
