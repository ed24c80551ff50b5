// The collision checker as a component, which answers every STATE of its episode with CONTACTS. If a source
// provides the contacts, CONTACTS contains them in place of the computed ones, with the computed clearance.
// docs/messages.md describes the protocol.
#pragma once

#include <memory>
#include <optional>

#include "bus/component.h"
#include "collision/checker.h"
#include "collision/clearance_watch.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::collision {

class CollisionComponent : public Component {
 public:
  // source_decides: contacts come from MEASURED_CONTACTS (`evalbus watch --contacts source`). If they are
  // missing, the STATE is not answered, and the sim resends both.
  explicit CollisionComponent(Bus* bus, bool source_decides = false);

 private:
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);
  void OnMeasured(const contacts_t& measured);

  const bool source_decides_;
  // Last received MODEL, and the MODEL for which checker_ was created.
  std::optional<model_info_t> model_info_;
  model_info_t loaded_{};
  std::unique_ptr<CollisionChecker> checker_;
  // Clearance over the current episode.
  std::optional<ClearanceWatch> clearance_;
  contacts_t contacts_{};
  // Contacts of the source that belong to the STATE that follows.
  std::optional<contacts_t> measured_;
};

// Creates the checker of the physics model that MODEL names. Throws InputError if the file cannot be read,
// does not have MODEL's SHA-256, or does not fit MODEL.
std::unique_ptr<CollisionChecker> LoadChecker(const model_info_t& info);

}  // namespace evalbus::collision
