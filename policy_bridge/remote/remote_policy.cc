#include "policy_bridge/remote/remote_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/message_equality.h"
#include "policy_bridge/actions/holding_action.h"
#include "policy_bridge/remote/server_claims.h"

namespace evalbus::policy {
namespace {

constexpr auto kRetry = std::chrono::seconds(1);

// Largest accepted relative difference between the control rate and the contract's rate_hz.
constexpr double kRateTolerance = 0.05;

Contract Fitting(const Contract& contract, const model_info_t& info) {
  const double hz = 1e6 / static_cast<double>(info.timestep_us * info.substeps);
  if (std::abs(hz - contract.rate_hz) <= kRateTolerance * contract.rate_hz) return contract;
  throw InputError(
      fmt::format("{}: rate_hz: the policy acts at {:g} Hz, but the run has {:.5g} Hz (--control-hz)",
                  contract.file.string(), contract.rate_hz, hz));
}

}  // namespace

void CheckExecution(const Contract& contract, Execution execution) {
  if (execution != Execution::kRealTimeChunking || contract.takes_committed_actions()) return;
  const ActionSpace& space = contract.actions;
  const RotationForm form = space.rotation;
  const bool is_pose = space.kind == ActionKind::kEefPose || space.kind == ActionKind::kEefDelta;
  const bool is_linear = form == RotationForm::kNone || form == RotationForm::kRotation6d ||
                         form == RotationForm::kRotation6dInterleaved ||
                         form == RotationForm::kRotation6dRows;
  const bool is_quaternion = form == RotationForm::kQuaternionWxyz || form == RotationForm::kQuaternionXyzw;
  // Small rotations may be averaged in any form except quaternions, because the sign of a quaternion is
  // arbitrary.
  if (!is_pose || is_linear || (space.kind == ActionKind::kEefDelta && !is_quaternion)) return;
  throw InContract(contract,
                   "--execution rtc: the numbers of this rotation cannot be averaged to join two chunks; "
                   "expected joints, rotation_6d or deltas without quaternions, or an observation entry "
                   "'committed: actions'");
}

RemotePolicy::RemotePolicy(const Contract& contract, Latency latency, const mjModel& model,
                           const model_info_t& info, std::unique_ptr<PolicyClient> client)
    : contract_(Fitting(contract, info)),
      latency_(latency),
      info_(info),
      step_s_(static_cast<double>(info.timestep_us * info.substeps) / 1e6),
      is_realtime_(info.clock == clock_name::kRealtime),
      answer_window_(is_realtime_ ? std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                                        contract_.answer_window * step_s_ / info.realtime_factor))
                                  : Clock::duration::max()),
      observations_(Fitted(contract_, [&] { return ObservationBuilder(contract_, model, info); })),
      converter_(Fitted(contract_, [&] { return ActionConverter(contract_.actions, model, info); })),
      conversation_(client ? std::move(client) : MakePolicyClient(ClientOptionsOf(contract_))),
      schedule_(latency.execution, contract_.execute_steps) {}

void RemotePolicy::SetCallbacks(const PolicyCallbacks& callbacks) {
  callbacks_ = callbacks;
  conversation_.SetOnAnswer(callbacks.wake);
}

void RemotePolicy::Begin(const episode_begin_t& begin) {
  begin_ = begin;
  phase_ = is_connected_ ? Phase::kGreeting : Phase::kConnecting;
  // If the last episode ended during an inference, the answer of that inference must be discarded.
  is_answer_stale_ = conversation_.is_busy();
  tick_ = -1;
  image_request_.reset();
  images_.clear();
  failure_ = nullptr;
  asks_ = false;
  schedule_.Begin();
  last_delay_ = 0;
  observations_.Begin();
  converter_.Begin();
  last_ = {};
}

bool RemotePolicy::IsReady() {
  if (phase_ == Phase::kReady) return true;
  const auto now = Clock::now();
  if (is_answer_stale_) {
    try {
      if (!conversation_.Take()) return false;
    } catch (const ServerError&) {
      is_connected_ = false;
      phase_ = Phase::kConnecting;
    }
    is_answer_stale_ = false;
  }
  if (!conversation_.is_busy()) {
    if (retry_at_ && now < *retry_at_) return false;
    const bool connect = phase_ == Phase::kConnecting;
    const std::string prompt = contract_.PromptFor(info_.task, info_.instruction);
    conversation_.Start([connect, prompt, episode = begin_.header.episode](PolicyClient& client) {
      Reply reply;
      if (connect) reply.value = client.Connect();
      client.BeginEpisode(prompt, episode);
      return reply;
    });
    return false;
  }
  try {
    const auto answer = conversation_.Take();
    if (!answer) return false;
    if (phase_ == Phase::kConnecting && !std::exchange(has_compared_, true)) {
      const auto contradictions = FindContradictions(contract_, answer->reply.value);
      if (!contradictions.empty()) {
        throw InContract(contract_,
                         fmt::format("the contract contradicts the metadata of the server at {}; {}",
                                     contract_.url, contradictions.front()));
      }
    }
  } catch (const ServerError& error) {
    is_connected_ = false;
    phase_ = Phase::kConnecting;
    const bool may_come_back =
        error.kind() == ServerError::Kind::kUnreachable || error.kind() == ServerError::Kind::kTimeout;
    if (!may_come_back) throw EnvironmentError(error.what());
    const double return_s = contract_.deadlines.return_s;
    if (now - gone_since_.value_or(now) > std::chrono::duration<double>(return_s)) {
      throw LastingError(
          fmt::format("waited {:g} s for the policy's server (return_s): {}", return_s, error.what()));
    }
    if (!gone_since_) {
      gone_since_ = now;
      Note(fmt::format("waiting up to {:g} s for the policy's server: {}", return_s, error.what()));
    }
    retry_at_ = now + kRetry;
    return false;
  }
  if (gone_since_) Note("the policy's server answers again");
  gone_since_.reset();
  retry_at_.reset();
  is_connected_ = true;
  phase_ = Phase::kReady;
  return true;
}

void RemotePolicy::OnTick(const state_t& state) {
  tick_ = state.header.tick;
  tick_began_ = Clock::now();
  is_tick_new_ = true;
  if (last_.joint_position_rad.empty()) last_ = HoldingAction(state);
}

void RemotePolicy::ObserveTick(const state_t& state) {
  // With a real-time clock, an inference for an earlier tick may still be running, or its images may be being
  // rendered.
  if (image_request_ || conversation_.is_busy()) return;
  if (!std::exchange(is_tick_new_, false)) return;
  asks_ = tick_ >= contract_.settle_steps && schedule_.IsDue(tick_);
  if (!asks_ && !observations_.needs_every_tick()) return;
  image_request_.emplace();
  image_request_->header = state.header;
  if (asks_ || observations_.needs_every_image()) image_request_->view = observations_.views();
  image_request_->num_views = static_cast<int32_t>(image_request_->view.size());
  observed_ = state;
  images_.assign(image_request_->view.size(), std::nullopt);
}

bool RemotePolicy::has_all_images() const {
  return std::ranges::all_of(images_, [](const auto& image) { return image.has_value(); });
}

const image_request_t* RemotePolicy::image_request() const {
  return image_request_ && !has_all_images() ? &*image_request_ : nullptr;
}

void RemotePolicy::OnImage(const image_t& image) {
  if (!image_request_ || !SameTick(image.header, image_request_->header)) return;
  if (image.data.empty()) {
    // The image is no longer available, so the next tick is observed instead.
    image_request_.reset();
    return;
  }
  for (size_t i = 0; i < images_.size(); ++i) {
    if (SameView(image.view, image_request_->view[i])) images_[i] = image;
  }
  // With a real-time clock, Compute() may not be called before the next tick, so the observation is sent
  // here.
  try {
    PollAnswer();
  } catch (...) {
    failure_ = std::current_exception();
  }
}

void RemotePolicy::PollAnswer() {
  if (!image_request_ || !has_all_images()) return;
  std::vector<image_t> images;
  for (auto& image : images_) images.push_back(std::move(*image));
  observations_.Add(observed_, images);
  image_request_.reset();
  if (asks_) StartCall();
}

void RemotePolicy::StartCall() {
  observation_t record;
  const int64_t tick = observed_.header.tick;
  const ChunkSchedule::Rest rest = schedule_.RestAt(tick);
  ObservationBuilder::Committed committed;
  if (rest.count > 0 && latency_.execution == Execution::kRealTimeChunking) {
    committed.rows = std::span(rows_[static_cast<size_t>(rest.chunk % 2)])
                         .subspan(static_cast<size_t>(rest.first), static_cast<size_t>(rest.count));
    committed.delay_steps = std::min<int64_t>(expected_delay(), rest.count);
  }
  Value observation = observations_.Build(committed, &record);
  asked_ = observed_.header;
  schedule_.Ask(tick);
  asks_ = false;
  if (callbacks_.on_observation) callbacks_.on_observation(record);
  conversation_.Start(
      [observation = std::move(observation)](PolicyClient& client) { return client.Infer(observation); });
}

bool RemotePolicy::Compute(const state_t& state) {
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  if (state.header.tick != tick_) OnTick(state);
  try {
    if (const auto answer = conversation_.Take()) OnAnswer(*answer);
  } catch (const ServerError& error) {
    // After an error message from the server, the connection may still work, but reconnecting is always
    // safe.
    is_connected_ = false;
    throw;
  }
  // The tick is observed after the answer was taken, because the next inference may be due already.
  ObserveTick(state);
  PollAnswer();
  if (!image_request_ && !conversation_.is_busy()) return true;
  return is_realtime_ && (schedule_.At(tick_) || Clock::now() >= compute_again_at());
}

std::chrono::steady_clock::time_point RemotePolicy::compute_again_at() const {
  return is_realtime_ ? tick_began_ + answer_window_ : Clock::time_point::max();
}

Chunk RemotePolicy::ChunkOf(const Reply& reply) {
  try {
    Chunk chunk = ReadChunk(contract_, reply.value);
    has_understood_ = true;
    return chunk;
  } catch (const ServerError& error) {
    // If even the first answer cannot be read, the contract is wrong, and every episode would fail in the
    // same way.
    if (has_understood_) throw;
    throw InContract(contract_, fmt::format("the contract contradicts the answer of the server at {}: {}",
                                            contract_.url, error.what()));
  }
}

int64_t RemotePolicy::expected_delay() const {
  return latency_.kind == Latency::Kind::kFixed && !is_realtime_ ? HeldTicks(latency_.fixed_s, step_s_)
                                                                 : last_delay_;
}

void RemotePolicy::OnAnswer(const Conversation::Answer& answer) {
  Chunk chunk = ChunkOf(answer.reply);
  const double charged_s = latency_.kind == Latency::Kind::kMeasured ? answer.took_s
                           : latency_.kind == Latency::Kind::kFixed  ? latency_.fixed_s
                                                                     : 0;
  const int64_t delay = is_realtime_ ? tick_ - asked_.tick : HeldTicks(charged_s, step_s_);
  last_delay_ = delay;
  policy_action_t policy_action{};
  policy_action.header = asked_;
  policy_action.kind = NameOf(contract_.actions.kind);
  policy_action.num_steps = static_cast<int32_t>(chunk.rows.size());
  policy_action.num_values = contract_.actions.num_values;
  policy_action.value_mixed = chunk.rows;
  policy_action.execute_steps = contract_.execute_steps;
  policy_action.answered_s = answer.took_s;
  policy_action.server_s = answer.reply.server_s.value_or(-1);
  policy_action.held_ticks = static_cast<int32_t>(delay);
  if (callbacks_.on_policy_action) callbacks_.on_policy_action(policy_action);
  const int64_t number = schedule_.Arrive(asked_.tick + delay, static_cast<int>(chunk.rows.size()));
  if (latency_.execution == Execution::kRealTimeChunking && !contract_.takes_committed_actions()) {
    JoinRows(rows_[static_cast<size_t>((number + 1) % 2)], schedule_.overlap(), &chunk.rows);
  }
  rows_[static_cast<size_t>(number % 2)] = std::move(chunk.rows);
}

void RemotePolicy::Act(const state_t& state, action_t* action) {
  if (const auto step = schedule_.At(state.header.tick)) {
    const auto& rows = rows_[static_cast<size_t>(step->chunk % 2)];
    converter_.Convert(rows[static_cast<size_t>(step->row)], state, step_s_, &last_);
    if (!std::exchange(has_acted_, true)) CheckFirstStep(state, last_);
    *action = last_;
    return;
  }
  *action = last_;
  action->unreachable_poses = action->singular_poses = 0;
}

void RemotePolicy::CheckFirstStep(const state_t& state, const action_t& action) {
  const bool is_absolute =
      contract_.actions.kind == ActionKind::kJointPosition || contract_.actions.kind == ActionKind::kEefPose;
  if (!is_absolute || !contract_.first_step_rad) return;
  size_t next = 0;
  for (size_t i = 0; i < state.arm.size(); ++i) {
    for (size_t j = 0; j < state.arm[i].joint_position_rad.size(); ++j, ++next) {
      const double step = std::abs(action.joint_position_rad.at(next) - state.arm[i].joint_position_rad[j]);
      if (step <= *contract_.first_step_rad) continue;
      throw InContract(
          contract_,
          fmt::format("the policy's first action moves joint {} of arm {} by {:.3g} rad, the limit is {:g} "
                      "(action.first_step_rad): are its numbers absolute, in the order and unit of the "
                      "contract? If they are, raise "
                      "first_step_rad",
                      info_.arm[i].joint_name[j], info_.arm[i].name, step, *contract_.first_step_rad));
    }
  }
}

void RemotePolicy::Note(const std::string& text) const {
  if (callbacks_.note) callbacks_.note(text);
}

}  // namespace evalbus::policy
