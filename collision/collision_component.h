// The collision checker as a component: answers every STATE of its episode with CONTACTS. docs/messages.md
// describes the protocol.
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
  explicit CollisionComponent(Bus* bus);

 private:
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);

  // Last received MODEL, and the one of checker_.
  std::optional<model_info_t> model_info_;
  model_info_t loaded_{};
  std::unique_ptr<CollisionChecker> checker_;
  // Clearance over the current episode.
  std::optional<ClearanceWatch> clearance_;
  contacts_t contacts_{};
};

// Creates the checker of the physics model that MODEL names. Throws InputError if the file cannot be read,
// does not have MODEL's SHA-256, or does not fit MODEL.
std::unique_ptr<CollisionChecker> LoadChecker(const model_info_t& info);

}  // namespace evalbus::collision
