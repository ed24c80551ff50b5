// A policy as a component: says READY once it has MODEL and EPISODE_BEGIN, then answers each STATE with an
// ACTION. What a policy throws while it acts travels in the action and ends the episode with policy_error.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/component.h"
#include "evalbus/action_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "policy_bridge/factory.h"

namespace evalbus::policy {

class PolicyComponent : public Component {
 public:
  // policy: as FindPolicy() takes it. Throws InputError as that does.
  PolicyComponent(Bus* bus, const std::string& policy);

 private:
  void OnModel(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);

  std::string name_;
  PolicyMaker make_policy_;
  std::optional<model_info_t> model_;
  bool model_is_new_ = false;
  // Made for model_ when the next episode begins.
  std::unique_ptr<Policy> policy_;
  action_t action_{};
};

}  // namespace evalbus::policy
