#include "policy_bridge/policy_component.h"

#include <utility>

#include "bus/bus.h"
#include "bus/channels.h"
#include "models/physics_model.h"

namespace evalbus::policy {

PolicyComponent::PolicyComponent(Bus* bus, const std::string& policy)
    : Component(bus, "policy"), name_(policy), make_policy_(FindPolicy(policy)) {
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
}

void PolicyComponent::OnModel(const model_info_t& model) {
  if (!IsNewModel(model)) return;
  model_ = model;
  model_is_new_ = true;  // for the next episode; this one goes on as it began
}

void PolicyComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  if (!IsOfOurRun(begin.session)) return;
  EnterEpisode(begin);
  // EPISODE_BEGIN is repeated, so an episode whose MODEL comes late is prepared then.
  if (status_.state != component_status_t::IDLE || !model_) return;
  if (std::exchange(model_is_new_, false)) {
    policy_ = make_policy_(*LoadPhysicsModel(*model_), *model_);
  }
  log().Debug("plays {}", name_);
  policy_->Begin(begin);
  SayReady();
}

void PolicyComponent::OnState(const state_t& state) {
  if (!IsOurs(state.header) || status_.state != component_status_t::READY) return;
  if (state.header.tick <= status_.last_tick) {
    ++status_.foreign_messages;
    // The sim repeats a STATE whose ACTION it has not heard; a policy acts once for each.
    if (state.header.tick >= 0 && state.header.tick == status_.last_tick) {
      bus().Publish(channels::kAction, action_);
    }
    return;
  }
  try {
    policy_->Act(state, &action_);
  } catch (const std::exception& error) {
    action_ = {};
    action_.mode = action_t::JOINT_POSITION;
    action_.error = error.what();
    log().Warn("cannot act: {}", error.what());
  }
  action_.header = state.header;
  bus().Publish(channels::kAction, action_);
  Progress(state.header);
}

}  // namespace evalbus::policy
