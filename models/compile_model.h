// Compiles a composed MJCF document.
#pragma once

#include <string>
#include <vector>

#include "models/mujoco_ptr.h"
#include "models/scene_composer.h"

namespace evalbus {

// discard_visual: without what is only seen. Throws InputError, with the line of the model file that MuJoCo's
// compiler means where that can be told; what MuJoCo warns of is appended to warnings.
ModelPtr CompileModel(const SceneComposer& composer, bool discard_visual, std::vector<std::string>* warnings);

}  // namespace evalbus
