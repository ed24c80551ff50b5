#include "bus/component.h"

#include <algorithm>
#include <utility>

#include "base/text.h"
#include "bus/channels.h"
#include "bus/message.h"

namespace evalbus {
namespace {

constexpr auto kHeartbeat = std::chrono::milliseconds(400);

std::string Messages(int64_t n) { return std::to_string(n) + (n == 1 ? " message" : " messages"); }

}  // namespace

Component::Component(Bus* bus, std::string name, int64_t lag_window_ticks) : bus_(bus), log_(name, bus) {
  status_.component = std::move(name);
  status_.instance = bus->instance() != 0 ? bus->instance() : DrawId();
  status_.state = component_status_t::IDLE;
  status_.episode = status_.attempt = status_.last_finished_episode = -1;
  status_.last_tick = -1;
  status_.lag_window_ticks = lag_window_ticks;
}

void Component::Poll(SteadyTime now) {
  if (now - last_published_ >= kHeartbeat) PublishStatus();
  if (now - losses_told_ >= kHeartbeat) {
    LogDroppedMessages();
    losses_told_ = now;
  }
  log_.Poll(now);
}

void Component::PublishStatus() {
  status_.decode_errors = bus_->decode_errors();
  const int64_t of_other_runs = bus_->foreign_messages();
  status_.foreign_messages += of_other_runs - std::exchange(of_other_runs_, of_other_runs);
  bus_->Publish(channels::kStatus, status_);
  last_published_ = std::chrono::steady_clock::now();
  last_published_tick_ = status_.last_tick;
}

void Component::LogDroppedMessages() {
  const auto grown = [](int64_t now, int64_t* reported) { return now - std::exchange(*reported, now); };
  if (const int64_t n = grown(status_.decode_errors, &decode_errors_told_); n > 0) {
    log_.Warn("dropped {} that could not be decoded: from another program or version, or damaged",
              Messages(n));
  }
  if (const int64_t n = grown(status_.foreign_messages, &foreign_messages_told_); n > 0) {
    log_.Info("dropped {} that were repeated or belong to another episode", Messages(n));
  }
  if (const int64_t n = grown(of_other_runs_, &of_other_runs_told_); n > 0) {
    log_.Info("{} of them came from another run, or from a log being played", n);
  }
  if (const int64_t n = grown(status_.missing_ticks, &missing_ticks_told_); n > 0) {
    log_.Warn("{} never arrived", Plural(n, "tick"));
  }
}

void Component::Fail(const std::string& error) {
  status_.state = component_status_t::FAILED;
  status_.error = error;
  PublishStatus();
}

void Component::Stop() {
  if (status_.state != component_status_t::FAILED) status_.state = component_status_t::STOPPED;
  PublishStatus();
  LogDroppedMessages();
}

bool Component::IsNewModel() {
  if (bus_->session() == 0 || model_bytes_.empty()) return UpdateIfChanged(bus_->handled(), &model_bytes_);
  if (!std::ranges::equal(bus_->handled(), model_bytes_)) ++status_.foreign_messages;
  return false;
}

bool Component::HasEntered(const episode_begin_t& begin) const {
  return begin.header.episode == status_.episode && begin.header.attempt == status_.attempt &&
         begin.seed == seed_;
}

bool Component::EnterEpisode(const episode_begin_t& begin) {
  if (HasEntered(begin)) {
    PublishStatus();
    return false;
  }
  status_.session = begin.header.session;
  status_.state = component_status_t::IDLE;
  status_.episode = begin.header.episode;
  status_.attempt = begin.header.attempt;
  seed_ = begin.seed;
  header_t place = begin.header;
  place.tick = -1;
  log_.SetPlace(place);
  status_.last_tick = last_published_tick_ = -1;
  // An earlier attempt of this episode may have finished, but this attempt has not.
  if (status_.last_finished_episode == begin.header.episode) status_.last_finished_episode = -1;
  return true;
}

void Component::PublishReady() {
  status_.state = component_status_t::READY;
  PublishStatus();
}

bool Component::IsOurs(const header_t& header) {
  if (header.episode == status_.episode && header.attempt == status_.attempt && IsPlausible(header)) {
    return true;
  }
  ++status_.foreign_messages;
  return false;
}

void Component::Progress(const header_t& header) {
  const int64_t tick = header.tick;
  status_.last_tick = tick;
  log_.SetPlace(header);
  if (status_.lag_window_ticks > 0 && tick - last_published_tick_ >= status_.lag_window_ticks / 2)
    PublishStatus();
}

}  // namespace evalbus
