#include "sim/sim_component.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/random.h"
#include "base/text.h"
#include "models/mujoco_errors.h"
#include "models/task_family.h"

namespace evalbus::sim {
namespace {

using std::chrono::steady_clock;

SteadyTime::duration Duration(double s) {
  return std::chrono::duration_cast<SteadyTime::duration>(std::chrono::duration<double>(s));
}

}  // namespace

SimComponent::SimComponent(Bus* bus, const SimOptions& options)
    : EpisodeComponent(bus, options),
      options_(options),
      world_(prepared_.scene.physics.get(), prepared_.info, prepared_.robot, prepared_.task,
             prepared_.info.substeps) {
  CheckSeeds(options.seed_stream, options.seed, options.episodes);
  model_bytes_ = Encode(prepared_.info);
  SetMujocoWarningSink([this](const std::string& warning) { log().Warn("MuJoCo: {}", warning); });
  const SeedSource seeds{options.seed, options.seed_stream, FamilyOf(prepared_.task.name),
                         prepared_.variation};
  for (int i = 0; i < options.episodes; ++i) {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.episode = i;
    command.seed = seeds.OfEpisode(i);
    command.required_component = options.required;
    command.num_required = static_cast<int32_t>(options.required.size());
    queue_.push_back(command);
  }
  bus->Subscribe(channels::kCommand, [this](const command_t& m) { OnCommand(m); });
  bus->Subscribe(channels::kStatus, [this](const component_status_t& m) { OnStatus(m); });
  bus->Subscribe(channels::kAction, [this](const action_t& m) { OnAction(m); });
  bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& m) { OnPartial(m); });
  bus->Subscribe(channels::kEpisodeSummary, [this](const episode_summary_t& m) { OnSummary(m.header); });
  bus->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& m) { OnOwnEnd(m); });
  bus->SubscribeRaw(channels::kState.name,
                    [this](std::string_view, std::span<const uint8_t> data, int64_t) { OnOwnState(data); });
  if (!queue_.empty()) BeginNext();
}

SimComponent::~SimComponent() { SetMujocoWarningSink({}); }

void SimComponent::OnCommand(const command_t& command) {
  if (command.kind == command_t::STOP) {
    if (phase_ == Phase::kRunning) End(end_reason::kAborted, "stopped on command");
    done_ = true;
    return;
  }
  const bool is_same_episode = command.episode == status_.episode;
  // Senders repeat their commands in case a command is lost. Repetitions of START_EPISODE are ignored.
  if (is_same_episode && command.attempt == status_.attempt && command.seed == begin_.seed) return;
  // Attempt numbers only increase, so a command with an earlier attempt comes from an old log.
  if (command.kind != command_t::START_EPISODE || options_.episodes > 0 ||
      (is_same_episode && command.attempt < status_.attempt)) {
    ++status_.foreign_messages;
    return;
  }
  // Only the latest command is kept. The launcher repeats its command until the episode begins, so it
  // replaces a command from elsewhere, for which no component becomes ready.
  queue_ = {command};
  if (phase_ != Phase::kRunning) BeginNext();
}

void SimComponent::OnSummary(const header_t& header) {
  // With --episodes, the next episode begins automatically; otherwise the launcher commands it.
  if (options_.episodes == 0 || phase_ != Phase::kIdle || header.episode != status_.episode) return;
  if (queue_.empty()) {
    done_ = true;
  } else {
    BeginNext();
  }
}

void SimComponent::OnForeign(const std::string& what) {
  OnConflict(what + " that is not this sim's: is a second sim on this bus, or a log being played?");
}

void SimComponent::OnOwnState(std::span<const uint8_t> data) {
  header_t header{};
  if (phase_ == Phase::kIdle || !DecodeHeader<state_t>(data, &header)) return;
  if (header.episode != status_.episode || header.attempt != status_.attempt) return;
  // A foreign STATE of a later tick is a conflict, because components that answer it will not answer this
  // sim's. Two different STATEs of one tick are detected by the metrics process.
  if (phase_ == Phase::kRunning && header.tick <= state_.header.tick) return;
  OnForeign("a STATE");
}

void SimComponent::OnOwnEnd(const episode_end_t& end) {
  if (phase_ != Phase::kIdle && IsOurs(end.header)) OnForeign("an EPISODE_END");
}

void SimComponent::OnConflict(const std::string& what) {
  ++status_.foreign_messages;
  if (conflict_.empty()) conflict_ = what;
  // EPISODE_END is published immediately, because until then other components may handle foreign messages as
  // if they came from this sim.
  if (phase_ == Phase::kWaiting) state_.header = begin_.header;
  End(end_reason::kAborted, conflict_);
}

void SimComponent::BeginNext() {
  command_ = queue_.front();
  queue_.pop_front();
  BeginEpisode(command_);
  detector_.Start();
  conflict_.clear();
  deadline_misses_ = 0;
  newest_action_ = 0;
  success_us_.reset();
  pacer_ = {};
  published_.clear();
  action_latency_.Clear();
  partial_latency_.Clear();
  const Variation& variation = prepared_.task.variation(prepared_.variation);
  std::vector<Parameter> parameters = world_.Reset(command_.seed, variation, options_.seed_stream);
  if (!variation.appearance.empty()) {
    // Renderers compute the same changes from the seed. Here, they are computed only to record the
    // parameters.
    const ModelPtr drawn(mj_copyModel(nullptr, prepared_.scene.visual.get()));
    const std::vector<Parameter> seen = RandomizeAppearance(variation, command_.seed, drawn.get());
    parameters.insert(parameters.end(), seen.begin(), seen.end());
  }
  CheckDistinct(parameters, variation);
  for (const Parameter& parameter : parameters) {
    begin_.parameter_name.push_back(parameter.name);
    begin_.parameter_value_mixed.push_back(parameter.value);
  }
  begin_.num_parameters = static_cast<int32_t>(begin_.parameter_name.size());
  phase_ = Phase::kWaiting;
  AnnounceEpisode();
}

void SimComponent::OnStatus(const component_status_t& status) {
  const bool is_taken = readiness_.Update(status);
  if (!is_taken) ++status_.foreign_messages;
  if (phase_ == Phase::kIdle) return;
  if (!readiness_.twice().empty()) {
    return OnConflict("two processes on this bus claim to be the " + readiness_.twice());
  }
  if (!is_taken) return;
  if (phase_ == Phase::kWaiting) return StartIfReady();
  if (status.component == "policy" && status.state == component_status_t::FAILED &&
      status.episode == status_.episode && status.attempt == status_.attempt) {
    tick_.end = {end_reason::kPolicyError,
                 status.error.empty() ? "the policy reported that it failed" : status.error};
  }
  if (!options_.realtime) Advance();
}

void SimComponent::StartIfReady() {
  if (!readiness_.Missing().empty()) return;
  phase_ = Phase::kRunning;
  PublishReady();
  log().Info("begins, seed {}", begin_.seed);
  state_.header = begin_.header;
  pacer_.Start(steady_clock::now(), static_cast<double>(world_.tick_us()) * 1e-6 / options_.rtf);
  PublishState();
}

void SimComponent::PublishState() {
  world_.Fill(&state_);
  state_.deadline_misses = deadline_misses_;
  const auto now = steady_clock::now();
  tick_ = {};
  tick_.published = now;
  tick_.wait = Wait(now);
  if (options_.realtime) published_.push_back(now);
  unanswered_state_.MarkSent(now);
  Progress(state_.header);
  bus().Publish(channels::kState, state_);
}

void SimComponent::OnAction(const action_t& action) {
  if (phase_ != Phase::kRunning || !IsOurs(action.header)) return;
  const int64_t tick = state_.header.tick;
  if (action.header.tick > tick) {
    ++status_.foreign_messages;
    return;
  }
  const auto answer = detector_.Check(channels::kAction, action.header.tick, bus().handled());
  if (answer == ConflictDetector::Answer::kConflicting) {
    return OnConflict("two different actions for tick " + std::to_string(action.header.tick) +
                      ": is a second policy on this bus?");
  }
  // In lockstep, only the answer to the current tick is used. In real time, the answer to an earlier tick may
  // be the latest action of a slow policy, unless the answer to a later tick has overtaken it.
  const int64_t oldest = options_.realtime ? newest_action_ : tick;
  if (answer == ConflictDetector::Answer::kRepeated || action.header.tick < oldest) {
    ++status_.foreign_messages;
    return;
  }
  newest_action_ = action.header.tick;
  if (options_.realtime) TimeAnswer(action.header.tick, &action_latency_);
  const std::string fault = action.error.empty() ? world_.Apply(action) : action.error;
  if (action.header.tick == tick) tick_.has_action = true;
  if (!fault.empty()) {
    tick_.end = {action.is_server_error ? end_reason::kServerError : end_reason::kPolicyError, fault};
  }
  if (options_.realtime) return;
  StepAhead();
  Advance();
}

void SimComponent::OnPartial(const partial_metrics_t& partial) {
  if (phase_ != Phase::kRunning || !IsOurs(partial.header)) return;
  const int64_t tick = partial.header.tick;
  if (tick > state_.header.tick) {
    ++status_.foreign_messages;
    return;
  }
  const auto answer = detector_.Check(channels::kPartial, tick, bus().handled());
  if (answer == ConflictDetector::Answer::kConflicting) return OnConflict(detector_.conflict());
  if (!options_.realtime && (answer == ConflictDetector::Answer::kRepeated || tick != state_.header.tick)) {
    ++status_.foreign_messages;
    return;
  }
  if (partial.verdict == partial_metrics_t::SUCCESS && !success_us_) success_us_ = tick * world_.tick_us();
  if (options_.realtime) {
    if (answer == ConflictDetector::Answer::kNew) TimeAnswer(tick, &partial_latency_);
    // The verdict may belong to an earlier tick; it is still valid.
    if (partial.verdict == partial_metrics_t::FAILURE) return End(end_reason::kFailure);
    if (success_us_ && TimeIsUp()) EndInTime();
    return;
  }
  tick_.verdict = partial.verdict;
  Advance();
}

void SimComponent::TimeAnswer(int64_t tick, Durations* latency) {
  latency->Add(steady_clock::now() - published_[static_cast<size_t>(tick)]);
}

void SimComponent::StepAhead() {
  if (tick_.stepped || tick_.end || TimeIsUp()) return;
  tick_.stepped = true;
  if (!world_.Step()) tick_.end = {end_reason::kUnstable, world_.instability()};
}

void SimComponent::Advance() {
  if (!tick_.verdict) return;
  if (*tick_.verdict == partial_metrics_t::FAILURE) return End(end_reason::kFailure);
  if (TimeIsUp()) return EndInTime();
  // At the time limit, StepAhead() does nothing. If PARTIAL then reports a success, the episode continues and
  // the step must be made here.
  if (tick_.has_action) StepAhead();
  if (tick_.end) {
    End(tick_.end->first, tick_.end->second);
  } else if (tick_.has_action && readiness_.Lagging(state_.header.tick).empty()) {
    ++state_.header.tick;
    state_.header.sim_time_us += world_.tick_us();
    PublishState();
  }
}

void SimComponent::AdvanceRealtime(SteadyTime now) {
  if (now < pacer_.due()) return;
  if (tick_.end) return End(tick_.end->first, tick_.end->second);
  if (TimeIsUp()) return EndInTime();
  if (!tick_.has_action) {
    ++deadline_misses_;
    log().Debug("no ACTION in time: the last one is held");
  }
  if (!world_.Step()) return End(end_reason::kUnstable, world_.instability());
  ++state_.header.tick;
  state_.header.sim_time_us += world_.tick_us();
  PublishState();
  pacer_.Published(tick_.published);
}

void SimComponent::End(std::string reason, std::string detail) {
  if (success_us_) KeepSuccess(&reason, &detail);
  phase_ = Phase::kIdle;
  end_ = {};
  end_.header = state_.header;
  end_.end_reason = reason;
  end_.detail = detail;
  if (options_.realtime) {
    end_.pacing_error = pacer_.Error();
    end_.late_ticks = pacer_.late_ticks();
    end_.action_latency = action_latency_.Distribution();
    end_.partial_latency = partial_latency_.Distribution();
  }
  if (reason == end_reason::kAborted) {
    log().Warn("{}", EndText());
  } else {
    log().Info("{}", EndText());
  }
  if (deadline_misses_ + end_.late_ticks > 0) {
    log().Warn("{} without an ACTION in time, {} late by a whole tick or more",
               Plural(deadline_misses_, "tick"), end_.late_ticks);
  }
  PublishEnd();
  if (options_.episodes == 0 && !queue_.empty()) BeginNext();
}

void SimComponent::Poll(SteadyTime now) {
  if (IsEndDue(now)) log().Info("resending EPISODE_END until the next episode begins");
  EpisodeComponent::Poll(now);
  if (phase_ != Phase::kRunning) return;
  if (options_.realtime) {
    AdvanceRealtime(now);
  } else {
    CheckAnswerTimeouts(now);
  }
  // MODEL is published after a repeated STATE, because in a small receive buffer it could displace the STATE.
  if (phase_ == Phase::kRunning) RepeatModel(now);
}

void SimComponent::CheckAnswerTimeouts(SteadyTime now) {
  const int64_t tick = state_.header.tick;
  const auto waited = tick_.wait.Elapsed(now);
  const auto [lacking, from] = MissingScore(tick);
  if (!(tick_.has_action && tick_.verdict) && unanswered_state_.Due(now)) {
    const double waited_s = std::chrono::duration<double>(waited).count();
    if (tick_.verdict) {
      log().Info("no ACTION from policy for {:.1f} s: resending STATE", waited_s);  // a slow policy
    } else {
      log().Warn("no {} from {} for {:.1f} s: resending STATE", lacking, from, waited_s);
    }
    unanswered_state_.MarkSent(now);
    bus().Publish(channels::kState, state_);
  }
  if (!tick_.verdict && waited > Duration(options_.metrics_timeout_s)) {
    End(end_reason::kAborted, fmt::format("no {} for tick {} from {} within {:g} s", lacking, tick, from,
                                          options_.metrics_timeout_s));
  } else if (tick_.verdict && !tick_.has_action && waited > Duration(options_.policy_timeout_s)) {
    End(end_reason::kPolicyTimeout,
        fmt::format("no ACTION for tick {} from policy within {:g} s", tick, options_.policy_timeout_s));
  } else if (tick_.verdict && tick_.has_action && waited > Duration(options_.metrics_timeout_s)) {
    const std::string laggard = readiness_.Lagging(tick);
    End(end_reason::kAborted, fmt::format("{} does not keep up: {} behind at tick {}", laggard,
                                          Plural(tick - readiness_.LastTick(laggard), "tick"), tick));
  }
}

SteadyTime SimComponent::next_poll() const {
  return phase_ == Phase::kRunning && options_.realtime ? pacer_.due() : SteadyTime::max();
}

}  // namespace evalbus::sim
