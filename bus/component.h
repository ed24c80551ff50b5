// What every process of a run has in common: a component works in its message handlers, reports its health on
// STATUS and in its log, and is hosted either alone in a process (bus/host.h) or with the others on one
// in-process bus.
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
  // lag_window_ticks: see component_status_t; 0 = the sim never waits for this component.
  Component(Bus* bus, std::string name, int64_t lag_window_ticks = 0);
  virtual ~Component() = default;
  Component(const Component&) = delete;
  Component& operator=(const Component&) = delete;

  const component_status_t& status() const { return status_; }

  // Wall-clock duties. The host calls it at least every 100 ms, and at next_poll(). Overrides call
  // Component::Poll.
  virtual void Poll(SteadyTime now);
  virtual SteadyTime next_poll() const { return SteadyTime::max(); }
  // True ends a host that is alone in its process.
  virtual bool done() const { return false; }

  // Says STATUS FAILED with one line of text.
  void Fail(const std::string& error);
  void Stop();

 protected:
  Bus& bus() { return *bus_; }

  // True for a MODEL to use from the next episode on: one that differs from the last one, or, in a session,
  // the first one, since the sim of a session publishes no other.
  bool IsNewModel();
  // True while in the episode, attempt and seed that it begins.
  bool HasEntered(const episode_begin_t& begin) const;
  // Enters the episode unless it is the one we are in (EPISODE_BEGIN is repeated until everybody is ready):
  // true when it is new and the component must prepare before it calls SayReady.
  bool EnterEpisode(const episode_begin_t& begin);
  void SayReady();
  // True if a message with this header belongs to the episode entered; counted as foreign otherwise.
  bool IsOurs(const header_t& header);
  // A tick was handled; publishes STATUS often enough for flow control.
  void Progress(const header_t& header);
  void PublishStatus();

  Log& log() { return log_; }

  component_status_t status_{};

 private:
  // Says in the log what was lost and dropped since it last did.
  void LogDroppedMessages();

  Bus* bus_;
  Log log_;
  // Messages of other sessions, counted in foreign_messages.
  int64_t of_other_runs_ = 0;
  // As far as the log has reported them.
  int64_t decode_errors_told_ = 0, foreign_messages_told_ = 0, missing_ticks_told_ = 0,
          of_other_runs_told_ = 0;
  std::vector<uint8_t> model_bytes_;
  // Of the episode entered.
  int64_t seed_ = 0;
  SteadyTime last_published_{}, losses_told_{};
  int64_t last_published_tick_ = -1;
};

}  // namespace evalbus
