// The collision checker as a component: answers every STATE of its episode with CONTACTS. See
// docs/messages.md for the protocol.
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

  // Last MODEL, and the one that checker_ was made from.
  std::optional<model_info_t> model_info_;
  model_info_t loaded_{};
  std::unique_ptr<CollisionChecker> checker_;
  // Of the episode.
  std::optional<ClearanceWatch> clearance_;
  contacts_t contacts_{};
};

// Checker of the physics model that MODEL names. Throws InputError when the file cannot be read, is not the
// one that MODEL's SHA-256 stands for, or does not fit MODEL.
std::unique_ptr<CollisionChecker> LoadChecker(const model_info_t& info);

}  // namespace evalbus::collision
