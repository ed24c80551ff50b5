// Tests, pixel by pixel, the trail of a wrist that moves along a known line.
#include "viz/images/trail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace evalbus::viz::trail_test {

// One arm moves by 0.1 m along x in each tick of 0.1 s. It is 1 m in front of a camera that looks along -z
// from the origin. Half of the image's 480 pixels is 1 m there.
constexpr CameraPose kCamera{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 90};
constexpr FrameSize kSize{640, 480};

std::vector<state_t> States(int count) {
  std::vector<state_t> states(count);
  for (int k = 0; k < count; ++k) {
    states[k].header.sim_time_us = 100000 * k;
    states[k].arm.resize(1);
    std::copy_n(std::array{0.1 * k, 0.0, -1.0}.begin(), 3, states[k].arm[0].wrist_position_m);
  }
  return states;
}

// Returns the blue of the pixel on the path at this tick: 24 pixels per tick to the right of the image's
// center.
int Blue(const Frame& frame, double ticks) {
  const auto x = static_cast<size_t>(320 + 24 * ticks);
  return frame.bgrx[(240 * 640 + x) * 4];
}

Frame Drawn(int count, double seconds) {
  Frame frame(kSize);
  std::ranges::fill(frame.bgrx, 0);
  DrawTrails(States(count), seconds, kCamera, &frame);
  return frame;
}

TEST(Trail, FadesWithAge) {
  const Frame frame = Drawn(11, 1);
  // A segment has the opacity of its older end, in steps of a 24th.
  EXPECT_NEAR(Blue(frame, 9.8), 0.698 * 0.9 * 255 * 22 / 24, 2);
  EXPECT_NEAR(Blue(frame, 5.5), 0.698 * 0.9 * 255 * 13 / 24, 2);
  EXPECT_LT(Blue(frame, 1.5), 40);
  EXPECT_EQ(Blue(frame, 10.5), 0) << "in front of the wrist";
}

TEST(Trail, EndsAtItsLength) {
  const Frame frame = Drawn(11, 0.5);
  EXPECT_GT(Blue(frame, 8), 60);
  EXPECT_EQ(Blue(frame, 4.5), 0);
}

TEST(Trail, NothingIsDrawnWithoutAPath) {
  const Frame none = Drawn(1, 1);
  EXPECT_TRUE(std::ranges::all_of(none.bgrx, [](uint8_t value) { return value == 0; }));
}

}  // namespace evalbus::viz::trail_test
