// Converts a run's visual model to the entities of a foxglove.SceneUpdate. Each body that has visible geoms
// becomes one entity in its own frame.
#pragma once

#include <nlohmann/json.hpp>

#include "viz/viewer/scene_blocks.h"

namespace evalbus::exports {

// Meshes become triangles, with coordinates rounded to 0.01 mm. Boxes, spheres, ellipsoids and cylinders are
// primitives. A capsule becomes a cylinder and two spheres, and an infinite plane becomes a square of 10 m.
// Textures are replaced by their material's color. appearance: color changes for one episode
// (SceneBlocks::Appearance()), or null.
nlohmann::ordered_json SceneEntities(const viz::SceneBlocks& scene, const nlohmann::ordered_json& appearance);

}  // namespace evalbus::exports
