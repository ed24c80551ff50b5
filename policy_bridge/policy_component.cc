#include "policy_bridge/policy_component.h"

#include <fmt/format.h>

#include <exception>
#include <stdexcept>
#include <utility>

#include "base/errors.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "lcmtypes/message_equality.h"
#include "models/physics_model.h"

namespace evalbus::policy {
namespace {

// Clears an action but keeps the capacity of its lists, so that a tick allocates no memory.
void Clear(action_t* action) {
  action_t empty{};
  empty.joint_position_rad.swap(action->joint_position_rad);
  empty.gripper_closing.swap(action->gripper_closing);
  empty.joint_position_rad.clear();
  empty.gripper_closing.clear();
  *action = std::move(empty);
}

// Throws if a count in the action differs from the size of its list, because the encoder would read past the
// end of the list.
void CheckSizes(const action_t& action) {
  const auto check = [](const char* count, int32_t set, const char* values, size_t size) {
    if (std::cmp_equal(set, size)) return;
    throw std::runtime_error(
        fmt::format("the policy set {} to {}, but {} has {} values", count, set, values, size));
  };
  check("num_joints", action.num_joints, "joint_position_rad", action.joint_position_rad.size());
  check("num_grippers", action.num_grippers, "gripper_closing", action.gripper_closing.size());
}

}  // namespace

PolicyComponent::PolicyComponent(Bus* bus, const PolicyOptions& options)
    : PolicyComponent(bus, options.policy, FindPolicy(options)) {}

PolicyComponent::PolicyComponent(Bus* bus, std::string name, PolicyMaker make_policy)
    : Component(bus, "policy"), name_(std::move(name)), make_policy_(std::move(make_policy)) {
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
}

void PolicyComponent::OnModel(const model_info_t& model) {
  if (!IsNewModel()) return;
  model_ = model;
  model_is_new_ = true;  // used for the next and later episodes; the current episode keeps its model
}

void PolicyComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  if (EnterEpisode(begin)) {
    is_starting_ = is_computing_ = false;
  }
  // EPISODE_BEGIN is repeated. If MODEL arrives late, the episode is prepared at the next repetition.
  if (status_.state != component_status_t::IDLE || !model_ || is_starting_) return;
  if (std::exchange(model_is_new_, false)) {
    policy_ = make_policy_(*LoadPhysicsModel(*model_), *model_);
    policy_->SetCallbacks(
        {.on_observation = [this](const observation_t& m) { this->bus().Publish(channels::kObservation, m); },
         .on_policy_action =
             [this](const policy_action_t& m) { this->bus().Publish(channels::kPolicyAction, m); },
         .note = [this](const std::string& text) { log().Warn("{}", text); },
         .wake = [event = this->bus().wake_event()] { event->Set(); }});
  }
  log().Debug("plays {}", name_);
  BeginPolicy(begin);
  is_starting_ = true;
  StartIfReady();
}

void PolicyComponent::BeginPolicy(const episode_begin_t& begin) {
  const auto failed = [this](const std::string& why) {
    return std::runtime_error(fmt::format("policy '{}': Begin() failed: {}", name_, why));
  };
  try {
    policy_->Begin(begin);
  } catch (const InputError&) {
    throw;
  } catch (const EnvironmentError&) {
    throw;
  } catch (const ServerError&) {
    throw;
  } catch (const std::exception& error) {
    throw failed(error.what());
  } catch (...) {
    throw failed("it threw an exception that is not a std::exception");
  }
}

void PolicyComponent::StartIfReady() {
  if (!is_starting_ || !policy_->IsReady()) return;
  is_starting_ = false;
  PublishReady();
}

void PolicyComponent::OnState(const state_t& state) {
  if (!IsOurs(state.header) || status_.state != component_status_t::READY) return;
  if (state.header.tick <= status_.last_tick) {
    ++status_.foreign_messages;
    // The sim repeats a STATE if an answer to it is missing. The policy acts only once per state.
    if (state.header.tick >= 0 && state.header.tick == status_.last_tick) {
      bus().Publish(channels::kAction, action_);
    }
    return;
  }
  // The policy is already computing the action for this state.
  if (is_computing_ && state.header.tick <= state_.header.tick) return;
  is_computing_ = false;
  if (Act(state)) return;
  state_ = state;
  is_computing_ = true;
}

bool PolicyComponent::Act(const state_t& state) {
  try {
    const bool is_done = policy_->Compute(state);
    const auto now = std::chrono::steady_clock::now();
    const image_request_t* request = policy_->image_request();
    // A new request is published immediately. It is repeated periodically, because a request may be lost.
    if (request && (!SameTick(request->header, observed_) || image_request_.Due(now))) {
      observed_ = request->header;
      if (!std::exchange(receives_images_, true)) {
        bus().SubscribeRaw(
            channels::kImage.name + std::string(".*"),
            [this](std::string_view, std::span<const uint8_t> data, int64_t) { OnImage(data); });
      }
      image_request_.MarkSent(now);
      bus().Publish(channels::kRequestImage, *request);
    }
    if (!is_done) return false;
    Clear(&action_);
    policy_->Act(state, &action_);
    CheckSizes(action_);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    SetError(error.what(), dynamic_cast<const ServerError*>(&error) != nullptr);
  } catch (...) {
    SetError("the policy threw an exception that is not a std::exception", false);
  }
  action_.header = state.header;
  bus().Publish(channels::kAction, action_);
  Progress(state.header);
  return true;
}

void PolicyComponent::SetError(const std::string& error, bool is_server_error) {
  action_ = {};
  action_.mode = action_t::JOINT_POSITION;
  action_.error = error;
  action_.is_server_error = is_server_error;
  log().Warn("cannot act: {}", error);
}

void PolicyComponent::ContinueComputing() {
  if (is_computing_ && Act(state_)) is_computing_ = false;
}

void PolicyComponent::OnImage(std::span<const uint8_t> data) {
  if (!policy_ || !policy_->image_request()) return;
  if (!Decode(data, &image_)) return bus().CountDecodeError();
  policy_->OnImage(image_);
  ContinueComputing();
}

void PolicyComponent::Poll(SteadyTime now) {
  Component::Poll(now);
  StartIfReady();
  ContinueComputing();
}

SteadyTime PolicyComponent::next_poll() const {
  return is_computing_ ? policy_->compute_again_at() : SteadyTime::max();
}

}  // namespace evalbus::policy
