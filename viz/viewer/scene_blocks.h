// The scene of a run for the page: the visual model with meshes and textures, and the collision geoms of
// MODEL. Each block is identified by its SHA-256, so a block that several scenes share is sent and stored
// once.
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
  // The models must be the results of LoadVisualModel() and LoadPhysicsModel() for this MODEL. Throws
  // InputError if they belong to another MODEL.
  SceneBlocks(const model_info_t& info, ModelPtr visual, const mjModel& physics);
  // Loads the models of this MODEL. Throws InputError.
  explicit SceneBlocks(const model_info_t& info);

  // Returns the id of the "scene" block.
  const std::string& id() const { return id_; }
  // All blocks of the scene by id, including the "scene" block.
  const std::map<std::string, std::string>& blocks() const { return blocks_; }
  // Returns the ids of the bodies that are not fixed to the world, ascending.
  const std::vector<int>& moving_bodies() const { return moving_; }
  // Returns the changes of materials, geoms, lights and cameras for this seed, in the format of the "episode"
  // block.
  nlohmann::ordered_json Appearance(int64_t seed) const;

 private:
  void MakeScene(const mjModel& physics);
  // Returns a description of a material of the visual model, or of a copy with a different appearance.
  nlohmann::ordered_json Material(const mjModel& model, int id) const;

  model_info_t info_;
  ModelPtr visual_;
  std::string id_;
  std::map<std::string, std::string> blocks_;
  std::vector<int> moving_;
  // Ids of texture blocks by MuJoCo's texture id.
  std::map<int, std::string> textures_;
};

}  // namespace evalbus::viz
