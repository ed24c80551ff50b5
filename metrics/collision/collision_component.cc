#include "metrics/collision/collision_component.h"

#include <mujoco/mujoco.h>

#include <iostream>
#include <string>

#include "bus/channels.h"
#include "bus/errors.h"
#include "models/scene.h"

namespace evalbus {
namespace {

// MuJoCo's own answers to trouble are to wait for a key and to write a file into the working folder.
void InstallMujocoHandlers() {
  mju_user_error = [](const char* message) { throw EnvironmentError(std::string("MuJoCo: ") + message); };
  mju_user_warning = [](const char* message) { std::cerr << "MuJoCo warning: " << message << std::endl; };
}

bool HasPoses(const state_t& state, int num_bodies) {
  if (state.num_bodies != num_bodies) return false;
  for (int body = 0; body < num_bodies; ++body) {
    if (state.body_position_m[body].size() != 3 || state.body_quat_wxyz[body].size() != 4) return false;
  }
  return true;
}

}  // namespace

std::unique_ptr<CollisionChecker> LoadChecker(const model_info_t& info) {
  InstallMujocoHandlers();
  if (Sha256File(info.physics_file) != info.physics_sha256) {
    throw InputError(info.physics_file +
                     " is not the model of this run: its SHA-256 is not the one in MODEL");
  }
  const ModelPtr model(mj_loadModel(info.physics_file.c_str(), nullptr));
  if (!model)
    throw InputError(info.physics_file + " is not a compiled model of MuJoCo " + mj_versionString());
  return std::make_unique<CollisionChecker>(model.get(), info);
}

CollisionComponent::CollisionComponent(Bus* bus) : Component(bus, "collision") {
  bus->Subscribe<model_info_t>(channels::kModel, [this](const model_info_t& m) { model_info_ = m; });
  bus->Subscribe<episode_begin_t>(channels::kEpisodeBegin,
                                  [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe<state_t>(channels::kState, [this](const state_t& m) { OnState(m); });
}

void CollisionComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  // Both are repeated until we are ready: without MODEL, wait for the next.
  if (!model_info_ || !EnterEpisode(begin)) return;
  if (!checker_ || loaded_.physics_sha256 != model_info_->physics_sha256 ||
      loaded_.run_id != model_info_->run_id) {
    checker_ = LoadChecker(*model_info_);
  }
  loaded_ = *model_info_;
  SayReady();
}

void CollisionComponent::OnState(const state_t& state) {
  if (!IsOurs(state.header)) return;
  const int64_t tick = state.header.tick;
  if (!checker_ || tick <= status_.last_tick || !HasPoses(state, loaded_.num_bodies)) {
    ++status_.foreign_messages;
    return;
  }
  status_.missing_ticks += tick - status_.last_tick - 1;
  for (int body = 0; body < state.num_bodies; ++body) {
    checker_->SetBodyPose(body, state.body_position_m[body].data(), state.body_quat_wxyz[body].data());
  }
  contacts_.header = state.header;
  contacts_.contact = checker_->FindContacts();
  contacts_.num_contacts = static_cast<int32_t>(contacts_.contact.size());
  std::optional<Clearance> clearance;
  if (loaded_.clearance_every_ticks > 0 && tick % loaded_.clearance_every_ticks == 0) {
    clearance = checker_->FindClearance();
  }
  contacts_.has_clearance = clearance.has_value();
  contacts_.clearance_m = clearance ? clearance->distance : 0;
  contacts_.clearance_robot_geom = clearance ? clearance->robot_geom : -1;
  contacts_.clearance_scene_geom = clearance ? clearance->scene_geom : -1;
  bus().Publish(channels::kContacts, contacts_);
  Progress(tick);
}

}  // namespace evalbus
