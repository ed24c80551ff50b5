// Computes the CONTACTS of a tick, for the collision component and for recorded trajectories. Pure.
#pragma once

#include "collision/checker.h"
#include "collision/clearance_watch.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::collision {

// Finds the contacts of a state and sets every member of CONTACTS. The state must contain all bodies of the
// checker's model, with finite poses. `watch` belongs to the episode; call this function once per tick, in
// order.
void FillContacts(const state_t& state, CollisionChecker* checker, ClearanceWatch* watch,
                  contacts_t* contacts);

// Replaces the contacts in CONTACTS by the contacts of a source, and keeps the clearance. Pairs of bodies
// that the checker does not check (neighboring links, fingers of one gripper, two fixtures) are ignored.
void ReplaceContacts(const contacts_t& measured, const CollisionChecker& checker, const model_info_t& info,
                     contacts_t* contacts);

}  // namespace evalbus::collision
