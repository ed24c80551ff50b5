#include "viz/images/trail.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "lcmtypes/clock.h"
#include "viz/images/colors.h"

namespace evalbus::viz {
namespace {

// The opacity is constant within each of these parts of a trail.
constexpr int kParts = 24;
constexpr double kOpacity = 0.9;  // opacity of the newest part of the trail
// kWidth: width of the lines in pixels, in an image that is kHeight pixels high.
constexpr double kWidth = 3, kHeight = 480;

// Returns the part to which the state belongs: 0 for the oldest states, kParts - 1 for the newest.
int PartOf(const state_t& state, double newest, double seconds) {
  const double age = newest - Seconds(state.header.sim_time_us);
  return std::clamp(static_cast<int>((1 - age / seconds) * kParts), 0, kParts - 1);
}

void DrawTrail(std::span<const state_t> states, size_t arm, double seconds, const CameraPose& camera,
               FrameSize size, Canvas* canvas) {
  const double scale = size.height / kHeight;
  Color color = arm == 0 ? kLeftArmColor : kRightArmColor;
  const double newest = Seconds(states.back().header.sim_time_us);
  std::vector<Point> points;
  int part = -1;
  const auto draw = [&] {
    color.a = kOpacity * (part + 1) / kParts;
    if (points.size() > 1) canvas->Line(points, kWidth, color);
  };
  for (const state_t& state : states) {
    if (arm >= state.arm.size()) continue;
    std::optional<Point> point = Project(camera, size, state.arm[arm].wrist_position_m);
    if (point) point = {point->x / scale, point->y / scale};
    const int next = PartOf(state, newest, seconds);
    if (point && next == part) {
      points.push_back(*point);
      continue;
    }
    // A part begins where the previous part ends.
    if (point) points.push_back(*point);
    draw();
    points.clear();
    if (point) points.push_back(*point);
    part = next;
  }
  draw();
}

}  // namespace

void DrawTrails(std::span<const state_t> states, double seconds, const CameraPose& camera, Frame* frame) {
  const int64_t first_us = states.back().header.sim_time_us - std::llround(seconds * 1e6);
  const auto first = std::ranges::lower_bound(states, first_us, {},
                                              [](const state_t& state) { return state.header.sim_time_us; });
  const auto recent = states.subspan(static_cast<size_t>(first - states.begin()));
  Canvas canvas(frame, frame->size.height / kHeight);
  for (size_t arm = 0; arm < recent.back().arm.size(); ++arm)
    DrawTrail(recent, arm, seconds, camera, frame->size, &canvas);
}

}  // namespace evalbus::viz
