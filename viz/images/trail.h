// Draws the trails of the wrists into an image: the paths of the last seconds, which fade with age.
#pragma once

#include <span>

#include "evalbus/state_t.hpp"
#include "viz/images/frame.h"
#include "viz/images/projection.h"

namespace evalbus::viz {

// Maximum length of a trail, s.
inline constexpr double kLongestTrail = 60;

// states: in time order, up to the state that the image shows. seconds: length of the trails in simulated
// time, more than 0. Trails are drawn over everything else.
void DrawTrails(std::span<const state_t> states, double seconds, const CameraPose& camera, Frame* frame);

}  // namespace evalbus::viz
