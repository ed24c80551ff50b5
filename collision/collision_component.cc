#include "collision/collision_component.h"

#include <algorithm>

#include "bus/channels.h"
#include "collision/tick_contacts.h"
#include "lcmtypes/clock.h"
#include "models/physics_model.h"

namespace evalbus::collision {
namespace {

bool HasPoses(const state_t& state, int num_bodies) {
  if (state.num_bodies != num_bodies) return false;
  for (int body = 0; body < num_bodies; ++body) {
    if (!IsPose(state.body[body].position_m, state.body[body].quat_wxyz)) return false;
  }
  return true;
}

}  // namespace

std::unique_ptr<CollisionChecker> LoadChecker(const model_info_t& info) {
  const ModelPtr model = LoadPhysicsModel(info);
  return std::make_unique<CollisionChecker>(model.get(), info);
}

CollisionComponent::CollisionComponent(Bus* bus, bool source_decides)
    : Component(bus, "collision"), source_decides_(source_decides) {
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) {
    if (IsNewModel()) model_info_ = m;
  });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
  if (source_decides_)
    bus->Subscribe(channels::kMeasuredContacts, [this](const contacts_t& m) { OnMeasured(m); });
}

void CollisionComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  // MODEL and EPISODE_BEGIN are repeated until all components are ready. Without MODEL, wait for the next
  // EPISODE_BEGIN.
  if (!model_info_ || !EnterEpisode(begin)) return;
  CheckMessageVersion(*model_info_);
  if (!checker_ || loaded_.physics_sha256 != model_info_->physics_sha256 ||
      loaded_.run_id != model_info_->run_id) {
    checker_ = LoadChecker(*model_info_);
    log().Debug("checks {}", model_info_->physics_file);
  }
  loaded_ = *model_info_;
  measured_.reset();
  clearance_.emplace(checker_.get(), ControlPeriodUs(loaded_));
  PublishReady();
}

void CollisionComponent::OnMeasured(const contacts_t& measured) {
  const auto is_geom = [this](int geom) { return geom >= 0 && geom < loaded_.num_geoms; };
  if (!checker_ || !IsOurs(measured.header) ||
      !std::ranges::all_of(measured.contact, [&](const contact_t& contact) {
        return is_geom(contact.geom_a) && is_geom(contact.geom_b);
      })) {
    ++status_.foreign_messages;
    return;
  }
  measured_ = measured;
}

void CollisionComponent::OnState(const state_t& state) {
  if (!IsOurs(state.header)) return;
  const int64_t tick = state.header.tick;
  if (!checker_ || tick <= status_.last_tick || !HasPoses(state, loaded_.num_bodies)) {
    ++status_.foreign_messages;
    // The sim repeats a STATE if an answer to it is missing. PARTIAL requires these CONTACTS.
    if (tick >= 0 && tick == status_.last_tick) bus().Publish(channels::kContacts, contacts_);
    return;
  }
  if (source_decides_ && (!measured_ || measured_->header.tick != tick)) {
    ++status_.foreign_messages;
    return;
  }
  status_.missing_ticks += tick - status_.last_tick - 1;
  FillContacts(state, checker_.get(), &*clearance_, &contacts_);
  if (source_decides_) ReplaceContacts(*measured_, *checker_, loaded_, &contacts_);
  bus().Publish(channels::kContacts, contacts_);
  Progress(state.header);
}

}  // namespace evalbus::collision
