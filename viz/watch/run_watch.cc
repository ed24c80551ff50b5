#include "viz/watch/run_watch.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/text.h"
#include "bus/channels.h"
#include "bus/log.h"
#include "bus/message.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/end_reason.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz {
namespace {

constexpr size_t kKeptEpisodes = 20, kKeptLines = 20;
// Maximum number of channels and components, so that a publisher of invented names cannot exhaust the memory.
constexpr size_t kMaxNames = 100;

double Seconds(SteadyTime::duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

const char* StateWord(const component_status_t& status) {
  switch (status.state) {
    case component_status_t::READY:
      return status.last_tick < 0 ? "ready" : "running";
    case component_status_t::FAILED:
      return "failed";
    case component_status_t::STOPPED:
      return "stopped";
    default:
      return "idle";
  }
}

void RunWatch::Receive(std::string_view channel, std::span<const uint8_t> data, SteadyTime now) {
  RollWindow(now);
  received_at_ = now;
  auto traffic = channels_.find(channel);
  if (traffic == channels_.end() && channels_.size() < kMaxNames) {
    traffic = channels_.emplace(channel, Traffic{}).first;
  }
  if (traffic != channels_.end()) ++traffic->second.count;
  if (channel == channels::kState) return OnState(data);
  if (channel == channels::kModel) return OnModel(data);
  const auto pass = [&]<class Message>(const Message& message) {
    if constexpr (requires { Receive(message, now); }) {
      Receive(message, now);
    } else {
      Receive(message);
    }
  };
  undecodable_ += !channels::Dispatch(channel, data, pass, channels::kPartial, channels::kContacts,
                                      channels::kStatus, channels::kEpisodeBegin, channels::kEpisodeEnd,
                                      channels::kEpisodeSummary, channels::kRunSummary, channels::kLog);
}

void RunWatch::Receive(const episode_begin_t& begin, SteadyTime now) {
  RollWindow(now);
  received_at_ = now;
  // EPISODE_BEGIN is repeated only before the first STATE. After that, it means that the same episode
  // restarts (in a replay).
  if (begin.header.episode == episode_ && begin.header.attempt == attempt_ && !simulated_us_) return;
  EnterEpisode(begin.header.episode, begin.header.attempt);
  events_.push_back(fmt::format("episode {} begins, seed {}{}", episode_, begin.seed,
                                attempt_ > 0 ? fmt::format(", attempt {}", int64_t{attempt_} + 1) : ""));
}

void RunWatch::Receive(const partial_metrics_t& partial, SteadyTime now) {
  RollWindow(now);
  received_at_ = now;
  if (partial.header.episode != episode_) return;
  if (IsPlausible(partial.header)) Simulated(partial.header);
  partial_ = partial;
  partial_is_old_ = false;
}

void RunWatch::Receive(const contacts_t& contacts) {
  if (contacts.header.episode != episode_) return;
  if (contacts.has_clearance) clearance_ = contacts;
  contacts_ = contacts;
}

void RunWatch::Receive(const episode_end_t& end) {
  if (end.header.episode != episode_) return;
  // EPISODE_END is repeated until the next episode begins. It must not replace the outcome, which is more
  // specific.
  const bool is_scored = summed_up_ && summed_up_->first == episode_;
  if (!is_scored) end_reason_ = end_reason::Text(Printable(end.end_reason));
  if (end.pacing_error.count > 0) pacing_ = end;
}

void RunWatch::EnterEpisode(int32_t episode, int32_t attempt) {
  episode_ = episode;
  attempt_ = attempt;
  summed_up_.reset();
  state_.reset();
  simulated_us_.reset();
  end_reason_.clear();
  partial_is_old_ = true;
  contacts_.reset();
  clearance_.reset();
}

// Decodes only the header, because STATE is large and nothing else of it is displayed.
void RunWatch::OnState(std::span<const uint8_t> data) {
  header_t header{};
  if (!DecodeHeader<state_t>(data, &header) || !IsPlausible(header)) {
    ++undecodable_;
    return;
  }
  // If no EPISODE_BEGIN was received for this episode, this process started during the episode.
  if (header.episode != episode_) EnterEpisode(header.episode, header.attempt);
  Simulated(header);
  state_ = header;
}

void RunWatch::Simulated(const header_t& header) {
  const int64_t before = simulated_us_.value_or(header.sim_time_us);
  window_simulated_us_ += std::max<int64_t>(0, header.sim_time_us - before);
  simulated_us_ = std::max(before, header.sim_time_us);
}

void RunWatch::OnModel(std::span<const uint8_t> data) {
  // MODEL is repeated and is the largest message, so the same bytes are not decoded again.
  if (std::equal(data.begin(), data.end(), model_bytes_.begin(), model_bytes_.end())) return;
  model_info_t model{};
  if (!Decode(data, &model)) {
    ++undecodable_;
    return;
  }
  model_bytes_.assign(data.begin(), data.end());
  names_.reset();
  model_.reset();
  other_version_.clear();
  if (model.message_version != model_info_t::VERSION) {
    // The content of another message version is not interpreted.
    other_version_ = fmt::format("message version {}, but this evalbus reads version {}",
                                 model.message_version, int{model_info_t::VERSION});
    events_.push_back("MODEL " + other_version_);
    return;
  }
  try {
    model_ = std::move(model);
    names_.emplace(*model_);
  } catch (const InputError& error) {
    model_.reset();
    ++undecodable_;
    events_.push_back(Printable(std::string("MODEL ") + error.what()));
  }
}

void RunWatch::Receive(const component_status_t& status, SteadyTime now) {
  const std::string component = Printable(status.component);
  if (health_.size() >= kMaxNames && !health_.contains(component)) return;
  Health& health = health_[component];
  if (status.state == component_status_t::FAILED && health.status.state != component_status_t::FAILED) {
    events_.push_back(fmt::format("{} failed: {}", component, Printable(status.error)));
  }
  if (health.silent) events_.push_back(fmt::format("{} publishes again", component));
  health.silent = false;
  health.status = status;
  health.received = now;
  // The lag is computed on arrival, because both the status and the last STATE are current at this time.
  health.lag = state_ && end_reason_.empty() && status.episode == episode_ && status.last_tick >= 0
                   ? std::max<int64_t>(0, state_->tick - status.last_tick)
                   : -1;
  if (status.component == "sim") {
    // STATUS identifies the current episode if this process started while the policy computes its next
    // action.
    if (episode_ < 0 && status.episode >= 0) EnterEpisode(status.episode, status.attempt);
    if (status.episode == episode_) attempt_ = status.attempt;
  }
}

void RunWatch::Receive(const episode_summary_t& summary) {
  const std::pair<int32_t, int32_t> key(summary.header.episode, summary.header.attempt);
  if (summed_up_ == key) return;  // the message is a repetition
  summed_up_ = key;
  const std::string outcome = Printable(end_reason::Outcome(summary.failure_reason));
  if (summary.header.episode == episode_ && !end_reason_.empty()) end_reason_ = outcome;
  done_.push_back(summary);
  if (done_.size() > kKeptEpisodes) done_.pop_front();
  events_.push_back(fmt::format("episode {} {} after {:.2f} s  {}{}{}", summary.header.episode, outcome,
                                summary.metrics.completion_time_s,
                                ScoreLine(summary.metrics, summary.extended),
                                summary.complete ? "" : "  incomplete",
                                summary.end_detail.empty() ? "" : ": " + Printable(summary.end_detail)));
}

void RunWatch::Receive(const run_summary_t& run) {
  // RUN_SUMMARY is repeated once a second. It is an event only if the number of episodes has changed.
  const bool news = run.num_episodes > 0 && (!run_ || run.num_episodes != run_->num_episodes);
  run_ = run;
  if (news) events_.push_back(DoneText(run, planned_episodes_));
}

void RunWatch::Receive(log_t line) {
  line.component = Printable(line.component);
  line.text = Printable(line.text);
  if (line.level >= log_t::WARN_LEVEL) {
    events_.push_back(fmt::format("{}  {}: {}", line.component, PlaceText(line.header), line.text));
  }
  log_.push_back(std::move(line));
  if (log_.size() > kKeptLines) log_.pop_front();
}

void RunWatch::RollWindow(SteadyTime now) {
  if (!started_) started_ = window_began_ = now;
  const double elapsed = Seconds(now - window_began_);
  if (elapsed < 1) return;
  for (auto& [name, channel] : channels_) {
    channel.rate = static_cast<double>(channel.count) / elapsed;
    channel.count = 0;
  }
  speed_ = static_cast<double>(window_simulated_us_) * 1e-6 / elapsed;
  window_simulated_us_ = 0;
  window_began_ = now;
  has_rates_ = true;
}

void RunWatch::Update(SteadyTime now) {
  RollWindow(now);
  if (is_over()) return;
  for (auto& [name, health] : health_) {
    if (health.is_bad() || now - health.received <= kSilent ||
        health.status.state == component_status_t::STOPPED) {
      continue;
    }
    health.silent = true;
    events_.push_back(fmt::format("no message from {} for {:.1f} s", name, Seconds(now - health.received)));
  }
}

bool RunWatch::is_over() const {
  // The component that leads the run stops last. This is `run` or `replay`, or the sim if components were
  // started by hand.
  bool found = false;
  for (const char* leader : {"run", "replay", "sim"}) {
    const auto health = health_.find(leader);
    if (health == health_.end() || (found && leader == std::string_view("sim"))) continue;
    if (health->second.status.state != component_status_t::STOPPED) return false;
    found = true;
  }
  return found;
}

double RunWatch::SilentFor(SteadyTime now) const {
  return Seconds(now - received_at_.value_or(started_.value_or(now)));
}

std::string RunWatch::GeomName(int32_t geom) const {
  if (names_ && geom >= 0 && geom < model_->num_geoms) return Printable(names_->GeomName(geom));
  return fmt::format("geom {}", geom);
}

std::string RunWatch::Phase() const {
  if (!end_reason_.empty()) return end_reason_;
  if (episode_ < 0) return "";
  if (state_) return "running";
  const auto sim = health_.find("sim");
  // True if an episode is in progress whose STATE has not been received yet.
  const bool mid_episode = sim != health_.end() && sim->second.status.state == component_status_t::READY &&
                           sim->second.status.episode == episode_ && sim->second.status.attempt == attempt_;
  return mid_episode ? "waiting for the next tick" : "waiting for components";
}

}  // namespace evalbus::viz
