// CONTACTS of a tick, for all who publish or record it. Pure.
#pragma once

#include "collision/checker.h"
#include "collision/clearance_watch.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::collision {

// Checks the poses of a state and fills in every member of CONTACTS. The state has the bodies of the
// checker's model, whose poses are finite. `watch` is that of the episode, to be called once per tick and in
// order.
void FillContacts(const state_t& state, CollisionChecker* checker, ClearanceWatch* watch,
                  contacts_t* contacts);

}  // namespace evalbus::collision
