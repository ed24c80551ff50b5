// Compares images as policies request them, color and depth, with geometry that was computed by hand.
#include <gtest/gtest.h>

#include <array>
#include <fstream>

#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/images/renderer.h"

namespace evalbus::viz::shot_test {

ModelPtr ModelOf(const std::string& xml) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "scene.xml";
  std::ofstream(file) << xml;
  char message[200] = "";
  ModelPtr model(mj_loadXML(file.c_str(), nullptr, message, sizeof message));
  EXPECT_TRUE(model) << message;
  return model;
}

using Rgb = std::array<int, 3>;

Rgb PixelAt(const std::vector<uint8_t>& rgb, FrameSize size, int column, int row) {
  const size_t i = static_cast<size_t>(row * size.width + column) * 3;
  return {rgb[i], rgb[i + 1], rgb[i + 2]};
}

// The camera is 1 m above; x points to the right and y up. At a distance of 1 m, the image is 2 m high (fovy
// 90). The colors of the squares of half a meter reveal mirroring, flipping and rotation: red at (-0.5, 0.5),
// green at (0.5, 0.5), white at (0, 0) and blue at (-0.5, -0.5).
constexpr char kMarker[] = R"(<mujoco>
  <visual>
    <headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>
  </visual>
  <statistic extent="1"/>
  <worldbody>
    <camera name="above" pos="0 0 1.01" xyaxes="1 0 0 0 1 0" fovy="90"/>
    <geom type="box" size="0.25 0.25 0.01" pos="-0.5 0.5 0" rgba="1 0 0 1"/>
    <geom type="box" size="0.25 0.25 0.01" pos="0.5 0.5 0" rgba="0 1 0 1"/>
    <geom type="box" size="0.25 0.25 0.01" pos="-0.5 -0.5 0" rgba="0 0 1 1"/>
    <geom type="box" size="0.25 0.25 0.01" pos="0 0 0" rgba="1 1 1 1"/>
  </worldbody></mujoco>)";

TEST(Marker, IsUprightUnmirroredAndRedIsFirst) {
  Renderer renderer(ModelOf(kMarker), {64, 64});
  renderer.SetState(state_t{});
  // Sizes are even, odd, and twice as wide as high. In a wide image, 1 m to the right is a quarter of the
  // width.
  for (const FrameSize size : {FrameSize{64, 64}, {65, 65}, {128, 64}, {129, 65}, {224, 224}}) {
    SCOPED_TRACE(std::to_string(size.width) + "x" + std::to_string(size.height));
    std::vector<uint8_t> rgb;
    renderer.RenderRgb({0, size}, &rgb);
    ASSERT_EQ(rgb.size(), static_cast<size_t>(size.width * size.height * 3));
    const auto at = [&](double x, double y) {
      const double meters_to_pixels = size.height / 2.0;
      return PixelAt(rgb, size, static_cast<int>(size.width / 2.0 + x * meters_to_pixels),
                     static_cast<int>(size.height / 2.0 - y * meters_to_pixels));
    };
    const Rgb nothing{0, 0, 0};
    // Checks the squares, also close to their edges, and the space between them.
    for (const double d : {-0.2, 0.0, 0.2}) {
      EXPECT_EQ(at(-0.5 + d, 0.5 + d), (Rgb{255, 0, 0}));
      EXPECT_EQ(at(0.5 + d, 0.5 - d), (Rgb{0, 255, 0}));
      EXPECT_EQ(at(-0.5 - d, -0.5 + d), (Rgb{0, 0, 255}));
      EXPECT_EQ(at(d, d), (Rgb{255, 255, 255}));
    }
    EXPECT_EQ(at(0.5, -0.5), nothing);
    EXPECT_EQ(at(-0.5, 0), nothing);
    EXPECT_EQ(at(0, 0.5), nothing);
    EXPECT_EQ(at(0.5, 0), nothing);
    EXPECT_EQ(at(0, -0.5), nothing);
    for (const double edge : {-0.3, 0.3}) EXPECT_EQ(at(0.5 + edge, 0.5), nothing);
  }
}

TEST(Marker, FieldOfViewIsTheVerticalOne) {
  Renderer renderer(ModelOf(kMarker), {64, 64});
  renderer.SetState(state_t{});
  std::vector<uint8_t> own, asked, narrow;
  renderer.RenderRgb({0, {64, 64}}, &own);
  // tan(26.565 degrees) = 0.5, so half as much is visible. The white square fills the middle half, 16 to 48.
  renderer.RenderRgb({0, {64, 64}, 2 * 26.565}, &narrow);
  for (const auto& [pixel, is_white] :
       std::initializer_list<std::pair<int, bool>>{{14, false}, {17, true}, {46, true}, {49, false}}) {
    EXPECT_EQ(PixelAt(narrow, {64, 64}, pixel, 32)[1] == 255, is_white) << pixel;
    EXPECT_EQ(PixelAt(narrow, {64, 64}, 32, pixel)[1] == 255, is_white) << pixel;
  }
  // A field of view of 90 degrees, which equals the camera's own, and the default 0 give the same image as no
  // field of view.
  renderer.RenderRgb({0, {64, 64}, 90}, &asked);
  EXPECT_TRUE(asked == own);
  renderer.RenderRgb({0, {64, 64}, 0}, &asked);
  EXPECT_TRUE(asked == own);
}

TEST(Depth, IsTheDistanceFromTheCamerasPlane) {
  // The camera is 3 m above a square of 4 m x 4 m. The top of a box is 0.5 m high, 2.5 m below the camera,
  // and 1 m x 0.5 m large. At 90 degrees, 80 pixels show 6 m on the ground and 5 m at the box's top, which
  // therefore has 16 x 8 pixels. A second box is near the upper right corner, because depth is measured to
  // the plane and not along the ray.
  Renderer renderer(ModelOf(R"(<mujoco>
    <statistic extent="2"/>
    <visual><map znear="0.01" zfar="20"/></visual>
    <asset><texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="0 0 0" width="8" height="48"/></asset>
    <worldbody>
      <camera name="above" pos="0 0 3" xyaxes="1 0 0 0 1 0" fovy="90"/>
      <geom type="box" size="2 2 0.5" pos="0 0 -0.5"/>
      <geom type="box" size="0.5 0.25 0.25" pos="0 0 0.25"/>
      <geom type="box" size="0.25 0.25 0.5" pos="1.5 1.5 0.5"/>
    </worldbody></mujoco>)"),
                    {16, 16});
  renderer.SetState(state_t{});
  std::vector<float> depth;
  for (const bool shadows : {true, false}) {
    renderer.RenderDepth({0, {80, 80}, 0, shadows}, &depth);
    ASSERT_EQ(depth.size(), 6400u);
    const auto at = [&](int column, int row) { return depth[static_cast<size_t>(row * 80 + column)]; };
    // With a depth buffer of 24 bits, a step at 3 m is 3^2 / 0.02 / 2^24 = 27 um.
    constexpr double kTolerance = 6e-5;
    for (const auto& [column, row] : {std::pair{40, 40}, {32, 36}, {47, 43}}) {
      EXPECT_NEAR(at(column, row), 2.5, kTolerance) << column << " " << row;
    }
    for (const auto& [column, row] :
         {std::pair{30, 40}, {49, 40}, {40, 34}, {40, 45}, {15, 15}, {64, 64}, {15, 64}}) {
      EXPECT_NEAR(at(column, row), 3, kTolerance) << column << " " << row;
    }
    // The second box's top is 2 m below the camera. It is at 1.25 to 1.75 m in both directions, at pixels 25
    // to 35 from the center.
    for (const auto& [column, row] : {std::pair{66, 6}, {73, 13}}) {
      EXPECT_NEAR(at(column, row), 2, kTolerance) << column << " " << row;
    }
    // Pixels without a surface have the depth zfar * extent.
    for (const auto& [column, row] : {std::pair{0, 0}, {79, 79}, {40, 78}}) {
      EXPECT_NEAR(at(column, row), 40, 1e-3) << column << " " << row;
    }
  }
}

class ShotTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Scene scene = LiftPotScene();
    model_ = new ModelPtr(Copy(*scene.visual));
    home_ = StateOf(HomeQpos(**model_));
  }
  static void TearDownTestSuite() { delete model_; }

  static std::vector<uint8_t> Rgb8(Renderer* renderer, const std::string& camera, FrameSize size,
                                   double fovy = 0, bool shadows = true) {
    std::vector<uint8_t> rgb;
    renderer->RenderRgb({FindCamera(renderer->model(), camera), size, fovy, shadows}, &rgb);
    return rgb;
  }

  static inline ModelPtr* model_ = nullptr;
  static inline state_t home_;
};

TEST_F(ShotTest, ColorIsThatOfAVideo) {
  constexpr FrameSize kSize{160, 120};
  Renderer renderer(Copy(**model_), kSize);
  renderer.SetState(home_);
  Frame frame(kSize);
  renderer.Render(FindCamera(renderer.model(), "front"), &frame);
  const std::vector<uint8_t> rgb = Rgb8(&renderer, "front", kSize);
  for (size_t i = 0; i < rgb.size(); ++i) ASSERT_EQ(rgb[i], frame.bgrx[i / 3 * 4 + 2 - i % 3]) << i;
  // Frames of a video do not depend on images that were requested between them.
  Rgb8(&renderer, "head", {300, 301}, 100, false);
  std::vector<float> depth;
  renderer.RenderDepth({0, {30, 20}}, &depth);
  Frame again(kSize);
  renderer.Render(FindCamera(renderer.model(), "front"), &again);
  EXPECT_TRUE(again.bgrx == frame.bgrx);
}

TEST_F(ShotTest, DoesNotDependOnWhatWasDrawnBefore) {
  Renderer one(Copy(**model_), {64, 64}), other(Copy(**model_), {640, 480});
  one.SetState(home_);
  other.SetState(home_);
  // The buffer of `other` is larger, and this image enlarges it further.
  Rgb8(&other, "overview", {801, 601});
  for (const FrameSize size : {FrameSize{224, 224}, {97, 33}, {1, 1}, {2, 1}, {500, 3}, {224, 224}}) {
    for (const char* camera : {"head", "left/hand/wrist"}) {
      EXPECT_TRUE(Rgb8(&one, camera, size) == Rgb8(&other, camera, size)) << camera << " " << size.width;
      std::vector<float> a, b;
      one.RenderDepth({FindCamera(one.model(), camera), size}, &a);
      other.RenderDepth({FindCamera(other.model(), camera), size}, &b);
      EXPECT_TRUE(a == b) << camera << " " << size.width;
    }
  }
}

TEST_F(ShotTest, ShadowsAreRenderedIfRequested) {
  Renderer renderer(Copy(**model_), {64, 64});
  renderer.SetState(home_);
  const auto lit = Rgb8(&renderer, "front", {128, 128}, 0, false),
             shaded = Rgb8(&renderer, "front", {128, 128});
  // A shadow only reduces the light, but a few pixels are rounded differently.
  int darker = 0, brighter = 0;
  for (size_t i = 0; i < lit.size(); ++i) {
    darker += shaded[i] + 8 < lit[i];
    brighter += shaded[i] > lit[i] + 8;
  }
  EXPECT_GT(darker, 1000);
  EXPECT_LT(brighter, darker / 100);
  EXPECT_TRUE(lit == Rgb8(&renderer, "front", {128, 128}, 0, false));
}

TEST_F(ShotTest, LargestAndSmallest) {
  Renderer renderer(Copy(**model_), {2, 2});
  renderer.SetState(home_);
  EXPECT_EQ(Rgb8(&renderer, "front", {2048, 2048}).size(), 2048u * 2048 * 3);
  EXPECT_EQ(Rgb8(&renderer, "front", {2047, 1}).size(), 2047u * 3);
  EXPECT_EQ(Rgb8(&renderer, "front", {1, 2047}).size(), 2047u * 3);
}

}  // namespace evalbus::viz::shot_test
