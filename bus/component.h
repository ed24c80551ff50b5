// Base class of all components of a run. A component processes messages in its handlers, and reports its
// health in STATUS messages and in its log. It runs either alone in a process (bus/host.h) or with the other
// components on one in-process bus.
#pragma once

#include <string>

#include "bus/bus.h"
#include "bus/log.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/model_info_t.hpp"

namespace evalbus {

class Component {
 public:
  // lag_window_ticks: see component_status_t. 0: the sim never waits for this component.
  Component(Bus* bus, std::string name, int64_t lag_window_ticks = 0);
  virtual ~Component() = default;
  Component(const Component&) = delete;
  Component& operator=(const Component&) = delete;

  const component_status_t& status() const { return status_; }

  // Periodic work in wall-clock time. The host calls it at least every 100 ms, and at next_poll(). Overrides
  // must call Component::Poll.
  virtual void Poll(SteadyTime now);
  virtual SteadyTime next_poll() const { return SteadyTime::max(); }
  // Returns true if a host that runs only this component must exit.
  virtual bool done() const { return false; }

  // Publishes STATUS FAILED with one line of text.
  void Fail(const std::string& error);
  void Stop();

 protected:
  Bus& bus() { return *bus_; }

  // Returns true if the received MODEL differs from the last one and must be used from the next episode on.
  // Within a session, only the first MODEL is used, because the sim of a session publishes only one.
  bool IsNewModel();
  // Returns true if the component is already in the episode, attempt and seed of this message.
  bool HasEntered(const episode_begin_t& begin) const;
  // Enters the episode. EPISODE_BEGIN is repeated until all components are ready. For the first
  // EPISODE_BEGIN, returns true; the component must then prepare the episode and call PublishReady(). For a
  // repetition, publishes STATUS and returns false.
  bool EnterEpisode(const episode_begin_t& begin);
  void PublishReady();
  // Returns true if a message with this header belongs to the current episode and IsPlausible(). Otherwise
  // counts the message as foreign.
  bool IsOurs(const header_t& header);
  // Must be called when a tick has been handled. Publishes STATUS often enough for flow control.
  void Progress(const header_t& header);
  void PublishStatus();

  Log& log() { return log_; }

  component_status_t status_{};

 private:
  // Logs the messages that were lost or dropped since the last call.
  void LogDroppedMessages();

  Bus* bus_;
  Log log_;
  // Number of messages of other sessions; included in foreign_messages.
  int64_t of_other_runs_ = 0;
  // Counts that the log has already reported.
  int64_t decode_errors_told_ = 0, foreign_messages_told_ = 0, missing_ticks_told_ = 0,
          of_other_runs_told_ = 0;
  std::vector<uint8_t> model_bytes_;
  // Seed of the current episode.
  int64_t seed_ = 0;
  SteadyTime last_published_{}, losses_told_{};
  int64_t last_published_tick_ = -1;
};

}  // namespace evalbus
