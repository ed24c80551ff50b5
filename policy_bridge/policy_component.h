// Runs a policy as a component. It publishes READY after it has received MODEL and EPISODE_BEGIN and the
// policy is ready. It then answers each STATE with an ACTION, unless a newer STATE arrives while the policy
// is still computing (with a real-time clock). Before it answers, it requests the images that the policy
// needs (REQUEST_IMAGE). If the policy throws an exception while it acts, the action reports the error, and
// the episode ends with policy_error or server_error; an InputError ends the process instead.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "bus/component.h"
#include "bus/repeater.h"
#include "evalbus/action_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "policy_bridge/policy_options.h"

namespace evalbus::policy {

class PolicyComponent : public Component {
 public:
  // Throws the errors of FindPolicy().
  PolicyComponent(Bus* bus, const PolicyOptions& options);
  // name: name of the policy in the component's log.
  PolicyComponent(Bus* bus, std::string name, PolicyMaker make_policy);

  void Poll(SteadyTime now) override;
  SteadyTime next_poll() const override;

 private:
  void OnModel(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);
  void OnImage(std::span<const uint8_t> data);
  // Calls the policy's Begin(), and adds the policy's name to errors of unknown type.
  void BeginPolicy(const episode_begin_t& begin);
  // Publishes READY if the policy is ready.
  void StartIfReady();
  // Publishes the ACTION for this state. Returns false while the policy is still computing it.
  bool Act(const state_t& state);
  void SetError(const std::string& error, bool is_server_error);
  void ContinueComputing();

  std::string name_;
  PolicyMaker make_policy_;
  std::optional<model_info_t> model_;
  bool model_is_new_ = false;
  // Created for model_ when the next episode begins.
  std::unique_ptr<Policy> policy_;
  // True if the EPISODE_BEGIN of the current episode has been received but the policy is not ready yet.
  bool is_starting_ = false;
  // True while the policy is computing an action; and the state that the action answers.
  bool is_computing_ = false;
  state_t state_{};
  // Header of the last REQUEST_IMAGE that was published; and the timer that repeats it.
  header_t observed_{};
  Repeater image_request_{std::chrono::milliseconds(200)};
  bool receives_images_ = false;
  image_t image_{};
  action_t action_{};
};

}  // namespace evalbus::policy
