#include "policy_bridge/policy_component.h"

#include <filesystem>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "models/physics_model.h"

namespace evalbus::policy {
namespace {

constexpr char kReplayPrefix[] = "replay:";

std::vector<action_t> ReadActions(const std::filesystem::path& log, int episode) {
  EventLogReader reader(log);
  std::vector<action_t> actions;
  LogEvent event;
  action_t action{};
  while (reader.Next(&event)) {
    if (event.channel != channels::kAction || !Decode(event.data, &action)) continue;
    if (action.header.episode != episode) continue;
    // An episode that was begun again starts over.
    while (!actions.empty() && actions.back().header.tick >= action.header.tick) actions.pop_back();
    actions.push_back(action);
  }
  // The gaps would be filled with actions that were held.
  if (reader.damaged_places() > 0) {
    throw InputError("policy \"replay\": " + log.string() +
                     " is damaged: " + std::to_string(reader.damaged_bytes()) + " bytes are no events");
  }
  return actions;
}

}  // namespace

Recording OpenRecording(const std::string& path) {
  if (std::filesystem::is_directory(path)) {
    if (!std::filesystem::is_directory(std::filesystem::path(path) / kEpisodesFolder)) {
      throw InputError("policy \"replay\": " + path + " is no run folder: it has no folder episodes/");
    }
    return [path](int episode) {
      const std::filesystem::path log = EpisodeLog(path, episode);
      return std::filesystem::exists(log) ? ReadActions(log, episode) : std::vector<action_t>{};
    };
  }
  if (!std::filesystem::exists(path)) throw InputError("policy \"replay\": " + path + " does not exist");
  return [path](int episode) { return ReadActions(path, episode); };
}

void CheckPolicy(const std::string& policy) {
  if (policy.starts_with(kReplayPrefix)) {
    OpenRecording(policy.substr(sizeof kReplayPrefix - 1));
  } else if (policy == "replay") {
    throw InputError("policy \"replay\": replay:PATH expected, with a run folder or an LCM event log");
  } else {
    CheckPolicyName(policy);
  }
}

PolicyComponent::PolicyComponent(Bus* bus, const std::string& policy)
    : Component(bus, "policy"), name_(policy) {
  CheckPolicy(policy);
  if (policy.starts_with(kReplayPrefix)) {
    name_ = "replay";
    recording_ = OpenRecording(policy.substr(sizeof kReplayPrefix - 1));
  }
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
}

void PolicyComponent::OnModel(const model_info_t& model) {
  if (!IsNews(bus().handled(), &model_bytes_)) return;
  model_ = model;
  model_is_new_ = true;  // for the next episode; this one goes on as it began
}

void PolicyComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  EnterEpisode(begin);
  // EPISODE_BEGIN is repeated, so an episode whose MODEL comes late is prepared then.
  if (status_.state != component_status_t::IDLE || model_bytes_.empty()) return;
  if (std::exchange(model_is_new_, false)) {
    policy_ = MakePolicy(name_, *LoadPhysicsModel(model_), model_, recording_);
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
