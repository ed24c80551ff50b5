// Measures how far images of the two painters (EVALBUS_PAINTER) differ, in videos and in observations of
// policies.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <vector>

#include "base/errors.h"
#include "models/scene.h"
#include "sim/world.h"
#include "viz/images/renderer.h"

namespace evalbus::viz::painters_test {

// Creates a renderer that draws with this painter.
std::unique_ptr<Renderer> RendererWith(const char* painter, const mjModel& model) {
  setenv("EVALBUS_PAINTER", painter, 1);
  auto renderer = std::make_unique<Renderer>(ModelPtr(mj_copyModel(nullptr, &model)), FrameSize{320, 240});
  unsetenv("EVALBUS_PAINTER");
  return renderer;
}

struct Difference {
  double mean = 0;
  int p99 = 0;
};

// Returns the mean and the 99th percentile of the absolute differences of all channels, in levels of 256.
Difference Compare(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  EXPECT_EQ(a.size(), b.size());
  std::vector<int> differences(a.size());
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += differences[i] = std::abs(a[i] - b[i]);
  const auto p99 = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() * 99 / 100);
  std::nth_element(differences.begin(), p99, differences.end());
  return {sum / static_cast<double>(a.size()), *p99};
}

TEST(Painters, ImagesDifferByLessThanOneLevelOnAverage) {
  Difference largest;
  for (const char* task : {"lift_pot", "stack_two_blocks", "pack_box"}) {
    const TaskSelection selection = FindTask(task);
    const RobotDescription robot = LoadRobot(selection.task.robot_file);
    const Scene scene = BuildScene(selection.task, robot);
    sim::World world(scene.physics.get(), scene.info, robot, selection.task, 10);
    world.Reset(1, selection.task.variation(selection.variation));
    state_t state{};
    world.Fill(&state);
    const auto ours = RendererWith("evalbus", *scene.visual), mujocos = RendererWith("mujoco", *scene.visual);
    ours->SetState(state);
    mujocos->SetState(state);
    for (int camera = 0; camera < scene.visual->ncam; ++camera) {
      for (const FrameSize size : {FrameSize{224, 224}, FrameSize{320, 240}, FrameSize{85, 63}}) {
        const Shot shot{camera, size};
        std::vector<uint8_t> a, b;
        ours->RenderRgb(shot, &a);
        mujocos->RenderRgb(shot, &b);
        const Difference difference = Compare(a, b);
        SCOPED_TRACE(fmt::format("{}, {}, {}x{}", task, mj_id2name(scene.visual.get(), mjOBJ_CAMERA, camera),
                                 size.width, size.height));
        EXPECT_LE(difference.mean, 0.5);
        EXPECT_LE(difference.p99, 2);
        largest.mean = std::max(largest.mean, difference.mean);
        largest.p99 = std::max(largest.p99, difference.p99);
      }
    }
  }
  fmt::print("largest mean difference {:.3f}, largest 99th percentile {} of 256 levels\n", largest.mean,
             largest.p99);
  // The painters are different programs. If the images were equal, only one of them would have been used.
  EXPECT_GT(largest.mean, 0);
}

TEST(Painters, AnUnknownOneIsRefused) {
  const Scene scene = [] {
    const TaskSelection selection = FindTask("lift_pot");
    return BuildScene(selection.task, LoadRobot(selection.task.robot_file));
  }();
  try {
    RendererWith("opengl", *scene.visual);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "EVALBUS_PAINTER: expected evalbus or mujoco, got opengl");
  }
  unsetenv("EVALBUS_PAINTER");
}

}  // namespace evalbus::viz::painters_test
