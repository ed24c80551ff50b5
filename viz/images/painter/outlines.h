// Outlines around objects. The painter draws outlined geoms with the alpha 0 and everything else with 1, so
// that each image contains the mask of what is outlined; outlines are then drawn by the processor. Uses no
// OpenGL.
#pragma once

#include "viz/images/painter/painter.h"
#include "viz/images/painter/scene_changes.h"

namespace evalbus::viz {

// Distance of the outermost pixel of an outline from its object, in drawn pixels (1.5 per pixel of a video).
inline constexpr int kOutlinePixels = 2;

// Returns the part with a margin of an outline's width, within the image: an outline changes where its object
// does.
Part WithOutlines(Part part, const PaintedImage& image);

// Makes those pixels of the part white that are next to an outlined geom and not part of one. The part must
// have been read from the framebuffer since its outlines were drawn.
void DrawOutlines(const Part& part, PaintedImage* image);

}  // namespace evalbus::viz
