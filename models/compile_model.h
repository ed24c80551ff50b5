// Compiles a composed MJCF document.
#pragma once

#include <string>
#include <vector>

#include "models/mujoco_ptr.h"
#include "models/scene_composer.h"

namespace evalbus {

// Compiles the document. discard_visual: omits visual geoms. Appends MuJoCo's warnings to `warnings`. Throws
// InputError for errors of MuJoCo's compiler, with file and line of the model file where they are known.
ModelPtr CompileModel(const SceneComposer& composer, bool discard_visual, std::vector<std::string>* warnings);

}  // namespace evalbus
