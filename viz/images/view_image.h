// Images as a policy asks for them: a view_t drawn into an image_t.
#pragma once

#include "evalbus/image_t.hpp"
#include "viz/images/renderer.h"

namespace evalbus::viz {

// Of a renderer's buffer before anybody has asked: most policies look at no more.
inline constexpr FrameSize kUsualViewSize{256, 256};

// Throws InputError for what cannot be drawn: an unknown camera, an absurd size or field of view, an encoding
// that loses something.
void CheckView(const view_t& view, const mjModel& model);

// What the renderer shows now, of the STATE with this header. `view` is a good one.
void DrawView(const view_t& view, const header_t& header, Renderer* renderer, image_t* image);

}  // namespace evalbus::viz
