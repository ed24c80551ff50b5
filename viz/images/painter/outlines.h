// Outlines around objects. The painter draws outlined geoms with alpha 0, and other opaque geoms and the
// background with alpha 1, so each image contains a mask of the outlined geoms. The outlines are then drawn
// from this mask on the CPU, without OpenGL.
#pragma once

#include "viz/images/painter/painter.h"
#include "viz/images/painter/scene_changes.h"

namespace evalbus::viz {

// Width of an outline: distance of its outermost pixel from the object, in drawn pixels (1.5 per pixel of a
// video).
inline constexpr int kOutlinePixels = 2;

// Returns the part enlarged by the width of an outline, clipped to the image. Outlines can change in this
// region if objects change in `part`.
Part WithOutlines(Part part, const PaintedImage& image);

// Makes the pixels of the part white that are next to an outlined geom but not part of one. Before each call,
// the part must be read from the framebuffer again.
void DrawOutlines(const Part& part, PaintedImage* image);

}  // namespace evalbus::viz
