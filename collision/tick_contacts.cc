#include "collision/tick_contacts.h"

#include <algorithm>
#include <iterator>
#include <optional>

namespace evalbus::collision {

void FillContacts(const state_t& state, CollisionChecker* checker, ClearanceWatch* watch,
                  contacts_t* contacts) {
  for (int body = 0; body < state.num_bodies; ++body) {
    checker->SetBodyPose(body, state.body[body].position_m, state.body[body].quat_wxyz);
  }
  contacts->header = state.header;
  contacts->contact = checker->FindContacts();
  contacts->num_contacts = static_cast<int32_t>(contacts->contact.size());
  const std::optional<Clearance> clearance = watch->At(state.header.tick, contacts->contact);
  contacts->has_clearance = clearance.has_value();
  contacts->clearance_m = clearance ? clearance->distance : 0;
  contacts->clearance_robot_geom = clearance ? clearance->robot_geom : -1;
  contacts->clearance_scene_geom = clearance ? clearance->scene_geom : -1;
  const Clearance points = clearance.value_or(Clearance{});
  std::ranges::copy(points.robot_point, contacts->clearance_robot_point_m);
  std::ranges::copy(points.scene_point, contacts->clearance_scene_point_m);
}

void ReplaceContacts(const contacts_t& measured, const CollisionChecker& checker, const model_info_t& info,
                     contacts_t* contacts) {
  contacts->contact.clear();
  std::ranges::copy_if(
      measured.contact, std::back_inserter(contacts->contact), [&](const contact_t& contact) {
        return checker.AreBodiesChecked(info.geom_body[contact.geom_a], info.geom_body[contact.geom_b]);
      });
  contacts->num_contacts = static_cast<int32_t>(contacts->contact.size());
}

}  // namespace evalbus::collision
