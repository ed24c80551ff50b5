// What a sim and a source's component have in common: they publish MODEL, EPISODE_BEGIN and EPISODE_END, and
// repeat them, because other components may have missed them (docs/messages.md).
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bus/channels.h"
#include "bus/component.h"
#include "bus/repeater.h"
#include "lcmtypes/end_reason.h"
#include "sim/prepared_scene.h"
#include "sim/readiness_tracker.h"

namespace evalbus::sim {

class EpisodeComponent : public Component {
 public:
  // Prepares the scene (PrepareScene) and throws its errors.
  EpisodeComponent(Bus* bus, const SimOptions& options)
      : Component(bus, "sim"), prepared_(PrepareScene(options)) {
    prepared_.info.session = bus->session();
    for (const std::string& warning : prepared_.scene.warnings) log().Warn("{}", warning);
    bus->Subscribe(channels::kModel, [this](const model_info_t&) {
      if (phase_ != Phase::kIdle && !std::ranges::equal(this->bus().handled(), model_bytes_))
        OnForeign("a MODEL");
    });
    bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
      if (phase_ != Phase::kIdle && !HasEntered(begin)) OnForeign("an EPISODE_BEGIN");
    });
  }

  void Poll(SteadyTime now) override {
    Component::Poll(now);
    if (phase_ == Phase::kWaiting && announcement_.Due(now)) AnnounceEpisode();
    if (!IsEndDue(now)) return;
    unanswered_end_.MarkSent(now);
    bus().Publish(channels::kEpisodeEnd, end_);
  }
  bool done() const override { return done_; }

 protected:
  enum class Phase {
    kIdle,     // between episodes
    kWaiting,  // EPISODE_BEGIN was published; not all components are ready
    kRunning,  // all components are ready
  };

  // Called for a message that only a sim publishes (what: "a MODEL") and that this component did not publish
  // itself. It reveals a second sim or a replayed log, so the episode's result is no longer certain.
  virtual void OnForeign(const std::string& what) = 0;
  // Returns the simulated time of the running episode's last STATE; 0 if there is none.
  virtual int64_t sim_time_us() const = 0;

  void BeginEpisode(const command_t& command) {
    begin_ = {};
    begin_.header.episode = command.episode;
    begin_.header.attempt = command.attempt;
    begin_.seed = command.seed;
    EnterEpisode(begin_);
    readiness_.Begin(command, status_.instance);
  }
  void AnnounceEpisode() {
    PublishModel();
    bus().Publish(channels::kEpisodeBegin, begin_);
    announcement_.MarkSent(std::chrono::steady_clock::now());
  }
  void PublishModel() {
    bus().Publish(channels::kModel, prepared_.info);
    model_.MarkSent(std::chrono::steady_clock::now());
    model_published_sim_us_ = sim_time_us();
  }
  // Must be called regularly while an episode is running.
  void RepeatModel(SteadyTime now) {
    if (model_.Due(now) || sim_time_us() - model_published_sim_us_ >= kRepeatModelSimUs) PublishModel();
  }
  // Returns the message that the STATE of this tick lacks if it has no score, and the component that
  // publishes this message. PARTIAL requires CONTACTS, and the STATUS of collision shows which of the two is
  // missing.
  std::pair<const char*, const char*> MissingScore(int64_t tick) const {
    if (readiness_.LastTick("collision") < tick) return {"CONTACTS", "collision"};
    return {"PARTIAL", "metrics"};
  }

  // Sets the reason of an end after a success. The success is final unless the episode is aborted or the
  // policy's server fails. Another reason for the end concerns only the time after the success and is added
  // to the detail.
  static void KeepSuccess(std::string* reason, std::string* detail) {
    if (*reason == end_reason::kSuccess || *reason == end_reason::kAborted ||
        *reason == end_reason::kServerError)
      return;
    *detail = fmt::format("after the success: {}{}{}", *reason, detail->empty() ? "" : ", ", *detail);
    *reason = end_reason::kSuccess;
  }
  // Returns end_ as text for the log.
  std::string EndText() const {
    return "ends, " + end_.end_reason + (end_.detail.empty() ? "" : ": " + end_.detail);
  }
  // Publishes end_. Poll() repeats it until the next episode begins.
  void PublishEnd() {
    unanswered_end_.MarkSent(std::chrono::steady_clock::now());
    bus().Publish(channels::kEpisodeEnd, end_);
    status_.state = component_status_t::IDLE;
    status_.last_finished_episode = status_.episode;
    PublishStatus();
  }
  // Returns true if Poll() would repeat EPISODE_END now.
  bool IsEndDue(SteadyTime now) const {
    return phase_ == Phase::kIdle && status_.last_finished_episode >= 0 && unanswered_end_.Due(now);
  }

  PreparedScene prepared_;
  // The encoded MODEL. Empty before it is complete.
  std::vector<uint8_t> model_bytes_;
  Phase phase_ = Phase::kIdle;
  bool done_ = false;
  episode_begin_t begin_{};
  episode_end_t end_{};
  ReadinessTracker readiness_;
  Repeater unanswered_state_{kRepeatUnanswered};

 private:
  // EPISODE_BEGIN is repeated until all components are ready.
  static constexpr auto kAnnouncePeriod = std::chrono::milliseconds(200);
  // MODEL is repeated during an episode for observers that start later: after the wall-clock period, which
  // matters for slow policies, or after the simulated period. The latter ensures that the log of a run faster
  // than real time also repeats MODEL.
  static constexpr auto kRepeatModel = std::chrono::seconds(1);
  static constexpr int64_t kRepeatModelSimUs = 2'000'000;
  // A message whose answer does not arrive is repeated, in case either was lost.
  static constexpr auto kRepeatUnanswered = std::chrono::seconds(2);

  Repeater announcement_{kAnnouncePeriod}, model_{kRepeatModel}, unanswered_end_{kRepeatUnanswered};
  int64_t model_published_sim_us_ = 0;
};

}  // namespace evalbus::sim
