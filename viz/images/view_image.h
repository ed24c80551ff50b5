// Draws images that a policy requests: a view_t becomes an image_t.
#pragma once

#include "evalbus/image_t.hpp"
#include "viz/images/renderer.h"

namespace evalbus::viz {

// Initial size of a renderer's buffer. Most policies request no larger images.
inline constexpr FrameSize kUsualViewSize{256, 256};

// Throws InputError if the view cannot be drawn, because the camera is unknown, the size or field of view is
// out of range, or the encoding is neither rgb8 nor depth32.
void CheckView(const view_t& view, const mjModel& model);

// Draws the renderer's current state into `image`. header: header of that STATE. CheckView(view) must have
// succeeded.
void DrawView(const view_t& view, const header_t& header, Renderer* renderer, image_t* image);

}  // namespace evalbus::viz
