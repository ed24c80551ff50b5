// Tests the white outlines around the task's objects in videos.
#include "viz/images/painter/outlines.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <utility>

#include "base/errors.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/images/renderer.h"

namespace evalbus::viz::outlines_test {

constexpr FrameSize kOutlinedSize{160, 120};

using Pixels = std::set<std::pair<int, int>>;

// Draws the outlines in a part of a gray image whose only outlined pixel is (4, 5). Returns the white pixels.
Pixels WhitePixels(const Part& part) {
  PaintedImage image(9, 10);
  std::fill(image.rgba.begin(), image.rgba.end(), uint8_t{100});
  for (size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  image.rgba[4 * (5 * 9 + 4) + 3] = 0;
  DrawOutlines(part, &image);
  Pixels white;
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 9; ++x) {
      const uint8_t* const pixel = &image.rgba[4 * static_cast<size_t>(y * 9 + x)];
      if (pixel[0] == 255 && pixel[1] == 255 && pixel[2] == 255) white.emplace(x, y);
    }
  }
  return white;
}

TEST(Outlines, SurroundWhatIsOutlined) {
  const Pixels all = {{4, 3}, {3, 4}, {4, 4}, {5, 4}, {2, 5}, {3, 5},
                      {5, 5}, {6, 5}, {3, 6}, {4, 6}, {5, 6}, {4, 7}};
  EXPECT_EQ(WhitePixels({0, 0, 9, 10}), all);
  EXPECT_EQ(WhitePixels({0, 0, 9, 5}), (Pixels{{4, 3}, {3, 4}, {4, 4}, {5, 4}}));
  EXPECT_EQ(WhitePixels({5, 5, 6, 6}), (Pixels{{5, 5}}));
}

TEST(Outlines, WidenAChangedPartWithinTheImage) {
  const PaintedImage image(9, 10);
  EXPECT_EQ(WithOutlines({3, 4, 5, 6}, image), (Part{1, 2, 7, 8}));
  EXPECT_EQ(WithOutlines({1, 0, 8, 9}, image), (Part{0, 0, 9, 10}));
  EXPECT_TRUE(WithOutlines({}, image).is_empty());
}

// Returns, by body id, whether the body belongs to the pot.
std::vector<bool> Pot(const mjModel& model) {
  const int pot = mj_name2id(&model, mjOBJ_BODY, "pot");
  std::vector<bool> is_pot;
  for (int body = 0; body < model.nbody; ++body) is_pot.push_back(model.body_rootid[body] == pot);
  return is_pot;
}

TEST(Outlines, OnlyBrightenPixelsBesideTheObject) {
  const Scene scene = LiftPotScene();
  Renderer plain(Copy(*scene.visual), kOutlinedSize, Look::kVideo),
      outlined(Copy(*scene.visual), kOutlinedSize, Look::kVideo, Pot(*scene.visual));
  Frame without(kOutlinedSize), with(kOutlinedSize);
  plain.SetState(StateOf(HomeQpos(*scene.visual)));
  outlined.SetState(StateOf(HomeQpos(*scene.visual)));
  const int camera = FindCamera(*scene.visual, "front");
  plain.Render(camera, &without);
  outlined.Render(camera, &with);
  int brighter = 0, darker = 0;
  for (size_t i = 0; i < with.bgrx.size(); ++i) {
    brighter += with.bgrx[i] > without.bgrx[i];
    darker += with.bgrx[i] < without.bgrx[i];
  }
  EXPECT_EQ(darker, 0);
  EXPECT_GT(brighter, 100);
  EXPECT_LT(brighter, kOutlinedSize.width * kOutlinedSize.height / 10);
}

// A renderer that is kept redraws only the changed part of an image.
TEST(Outlines, AreTheSameAsInANewImageWhenTheObjectMoves) {
  const Scene scene = LiftPotScene();
  Renderer kept(Copy(*scene.visual), kOutlinedSize, Look::kVideo, Pot(*scene.visual));
  const int camera = FindCamera(*scene.visual, "front");
  std::vector<double> qpos = HomeQpos(*scene.visual);
  for (const double step_m : {0.0, 0.003, 0.02, -0.05}) {
    qpos[static_cast<size_t>(QposIndex(*scene.visual, "pot")) + 1] += step_m;
    Renderer fresh(Copy(*scene.visual), kOutlinedSize, Look::kVideo, Pot(*scene.visual));
    Frame again(kOutlinedSize), anew(kOutlinedSize);
    kept.SetState(StateOf(qpos));
    fresh.SetState(StateOf(qpos));
    kept.Render(camera, &again);
    fresh.Render(camera, &anew);
    EXPECT_EQ(again.bgrx, anew.bgrx) << step_m;
  }
}

TEST(Outlines, AreRefusedWhereTheyCannotBeDrawn) {
  const Scene scene = LiftPotScene();
  setenv("EVALBUS_PAINTER", "mujoco", 1);
  Renderer renderer(Copy(*scene.visual), kOutlinedSize, Look::kVideo, Pot(*scene.visual));
  unsetenv("EVALBUS_PAINTER");
  renderer.SetState(StateOf(HomeQpos(*scene.visual)));
  Frame frame(kOutlinedSize);
  EXPECT_THROW(renderer.Render(FindCamera(*scene.visual, "front"), &frame), InputError);
}

TEST(Outlines, OfAnotherModelAreRefused) {
  const Scene scene = LiftPotScene();
  EXPECT_THROW(Renderer(Copy(*scene.visual), kOutlinedSize, Look::kVideo, {true}), InputError);
}

}  // namespace evalbus::viz::outlines_test
