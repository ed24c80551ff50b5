// A run's visual model as entities of a foxglove.SceneUpdate: one for each body, in its frame.
#pragma once

#include <nlohmann/json.hpp>

#include "viz/viewer/scene_blocks.h"

namespace evalbus::tools {

// Meshes are triangles, in steps of 0.01 mm; boxes, spheres, ellipsoids and cylinders are themselves, a
// capsule is a cylinder with two spheres, an endless plane is a square of 10 m. A texture is its material's
// color. appearance: changes of colors for one episode (SceneBlocks::Appearance()), or null.
nlohmann::ordered_json SceneEntities(const viz::SceneBlocks& scene, const nlohmann::ordered_json& appearance);

}  // namespace evalbus::tools
