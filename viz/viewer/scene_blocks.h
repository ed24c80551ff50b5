// The scene of a run as a page draws it: its visual model with meshes and textures, and the collision geoms
// of MODEL. Each block is known by its SHA-256, so that what scenes have in common is sent and stored once.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/mujoco_ptr.h"

namespace evalbus::viz {

class SceneBlocks {
 public:
  // Models as LoadVisualModel() and LoadPhysicsModel() give them for this MODEL. Throws InputError where they
  // are of another one.
  SceneBlocks(const model_info_t& info, ModelPtr visual, const mjModel& physics);
  // Loads them. Throws InputError.
  explicit SceneBlocks(const model_info_t& info);

  // Of the scene's own block.
  const std::string& id() const { return id_; }
  // All that it needs, itself too, by id.
  const std::map<std::string, std::string>& blocks() const { return blocks_; }
  // Bodies that are not fixed to the world for good, ascending.
  const std::vector<int>& moving_bodies() const { return moving_; }
  // What the seed changes of materials, geoms, lights and cameras, as the episode's block has it.
  nlohmann::ordered_json Appearance(int64_t seed) const;

 private:
  void MakeScene(const mjModel& physics);

  model_info_t info_;
  ModelPtr visual_;
  std::string id_;
  std::map<std::string, std::string> blocks_;
  std::vector<int> moving_;
};

}  // namespace evalbus::viz
