// Compares images with golden ones and with their expected contents.
#include "viz/images/renderer.h"

#include <cairo.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "base/errors.h"
#include "lcmtypes/source.h"
#include "tests/unit/dressed_scene.h"
#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/images/overlay.h"

namespace evalbus::viz::renderer_test {

constexpr FrameSize kGoldenSize{320, 240};

// Another Mesa version, or a processor with different vector instructions, may round differently and draw an
// edge one sample farther. Most pixels differ by at most this much, and only few by more.
constexpr int kGoldenTolerance = 6;
constexpr double kConforming = 0.995;

void WritePng(const Frame& frame, const std::filesystem::path& file) {
  std::filesystem::create_directories(file.parent_path());
  cairo_surface_t* surface =
      cairo_image_surface_create_for_data(const_cast<uint8_t*>(frame.bgrx.data()), CAIRO_FORMAT_RGB24,
                                          frame.size.width, frame.size.height, frame.size.width * 4);
  cairo_surface_write_to_png(surface, file.c_str());
  cairo_surface_destroy(surface);
}

// Returns an empty frame if there is no such file.
Frame ReadPng(const std::filesystem::path& file) {
  cairo_surface_t* surface = cairo_image_surface_create_from_png(file.c_str());
  Frame frame({cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface)});
  for (int row = 0; row < frame.size.height; ++row) {
    std::memcpy(&frame.bgrx[static_cast<size_t>(row * frame.size.width * 4)],
                cairo_image_surface_get_data(surface) + row * cairo_image_surface_get_stride(surface),
                static_cast<size_t>(frame.size.width) * 4);
  }
  cairo_surface_destroy(surface);
  return frame;
}

// Returns the share of pixels in which no channel differs by more than the tolerance.
double Conforming(const Frame& a, const Frame& b) {
  if (a.bgrx.size() != b.bgrx.size() || a.bgrx.empty()) return 0;
  size_t good = 0;
  for (size_t i = 0; i < a.bgrx.size(); i += 4) {
    bool same = true;
    for (size_t c = i; c < i + 3; ++c) same = same && std::abs(a.bgrx[c] - b.bgrx[c]) <= kGoldenTolerance;
    good += same;
  }
  return static_cast<double>(good) / (static_cast<double>(a.bgrx.size()) / 4);
}

void ExpectGolden(const Frame& frame, const std::string& name) {
  const std::filesystem::path golden =
      std::filesystem::path(EVALBUS_SOURCE_DIR) / "tests/data/golden" / (name + ".png");
  const double conforming = Conforming(frame, ReadPng(golden));
  if (conforming >= kConforming) return;
  const std::filesystem::path kept =
      std::filesystem::path(EVALBUS_BINARY_DIR) / "golden_failed" / (name + ".png");
  WritePng(frame, kept);
  ADD_FAILURE() << conforming * 100 << " % of the pixels are as in " << golden << "; the image is kept in "
                << kept << " (if it is as wanted, make it the golden one)";
}

class RendererTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = new Scene(LiftPotScene());
    renderer_ = new Renderer(Copy(*scene_->visual), kGoldenSize);
  }
  static void TearDownTestSuite() {
    delete renderer_;
    delete scene_;
  }

  static const mjModel& model() { return renderer_->model(); }
  static Frame Image(const std::string& camera, const std::vector<double>& qpos) {
    Frame frame(kGoldenSize);
    renderer_->SetState(StateOf(qpos));
    renderer_->Render(FindCamera(model(), camera), &frame);
    return frame;
  }
  // Returns the number of pixels that are clearly more red than anything else. Only the pot is red.
  static int RedPixels(const Frame& frame, double* mean_column = nullptr) {
    int count = 0;
    double sum = 0;
    for (size_t i = 0; i < frame.bgrx.size(); i += 4) {
      if (frame.bgrx[i + 2] < 40 || frame.bgrx[i + 2] < 3 * frame.bgrx[i + 1]) continue;
      ++count;
      sum += static_cast<double>(i / 4 % static_cast<size_t>(kGoldenSize.width));
    }
    if (mean_column) *mean_column = sum / count;
    return count;
  }

  static inline Scene* scene_ = nullptr;
  static inline Renderer* renderer_ = nullptr;
};

TEST_F(RendererTest, GoldenFrames) {
  std::vector<double> qpos = HomeQpos(model());
  for (const std::string camera : {"front", "head", "overview", "left/hand/wrist", "right/hand/wrist"}) {
    std::string name = camera;
    std::replace(name.begin(), name.end(), '/', '_');
    ExpectGolden(Image(camera, qpos), name);
  }
}

TEST_F(RendererTest, GoldenOverlay) {
  Frame frame({640, 480});
  for (size_t i = 0; i < frame.bgrx.size(); ++i) frame.bgrx[i] = 150;
  OverlayText text;
  text.title = "lift_pot/position";
  text.subtitle = "episode 3";
  text.maker = MakerText("noisy_expert", "bimanual_panda");
  text.clock = "12.30 s";
  metric_values_t scores{};
  scores.stage_name = {"left_gripper_touches_pot", "right_gripper_touches_pot", "pot_lifted"};
  scores.stage_reached = {1, 1, 0};
  scores.tracks_slippage = scores.tracks_collisions = 1;
  scores.slip_count = 2;
  scores.env_collision_count = 10;
  AddScores(scores, &text);
  const Overlay overlay(frame.size);
  Frame running = frame;
  overlay.Draw(text, &running);
  ExpectGolden(running, "overlay_running");
  text.end_reason = "time_limit";
  overlay.Draw(text, &frame);
  ExpectGolden(frame, "overlay_failure");
}

// A source may lack the data that a count requires.
TEST(OverlayText, HasOnlyCountsThatAreAvailable) {
  metric_values_t scores{};
  scores.tracks_slippage = scores.tracks_collisions = 1;
  scores.slip_count = kUnavailableCount;
  OverlayText text;
  AddScores(scores, &text);
  EXPECT_FALSE(text.counts.empty());
  for (const auto& [label, count] : text.counts) EXPECT_EQ(count, 0) << label;
}

TEST(OverlayText, NamesPolicyAndRobot) {
  EXPECT_EQ(MakerText("expert", "single_panda"), "expert on single_panda");
  EXPECT_EQ(MakerText("", "single_panda"), "single_panda");
  EXPECT_EQ(MakerText("replay:/a/very/long/path/of/a/folder/of/somebody", "r"),
            "replay:/a/very/long/path/of/a/folder/of… on r");
}

TEST_F(RendererTest, EqualStatesGiveEqualImages) {
  const std::vector<double> home = HomeQpos(model());
  const Frame first = Image("front", home);
  std::vector<double> other = home;
  other[static_cast<size_t>(QposIndex(model(), "left/joint1"))] = 0.5;
  Image("front", other);
  EXPECT_EQ(Image("front", home).bgrx, first.bgrx);
  Renderer again(Copy(*scene_->visual), kGoldenSize);
  Frame frame(kGoldenSize);
  again.SetState(StateOf(home));
  again.Render(FindCamera(again.model(), "front"), &frame);
  EXPECT_EQ(frame.bgrx, first.bgrx);
}

// Mesa's threads can crash each other and do not exist in a forked process.
TEST_F(RendererTest, MesaHasNoThreads) {
  Image("front", HomeQpos(model()));
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::ifstream comm(thread.path() / "comm");
    std::getline(comm, name);
    EXPECT_EQ(name.find("llvmpipe"), std::string::npos) << name;
    EXPECT_EQ(name.find("disk$"), std::string::npos) << name;
  }
}

TEST_F(RendererTest, PotIsSeenWhereItIs) {
  std::vector<double> qpos = HomeQpos(model());
  const size_t pot = static_cast<size_t>(QposIndex(model(), "pot"));
  for (const std::string camera : {"front", "head", "overview"}) {
    double middle = 0, moved = 0;
    qpos[pot + 1] = 0;
    EXPECT_GT(RedPixels(Image(camera, qpos), &middle), 800) << camera;
    qpos[pot + 1] = 0.15;  // to the robot's left
    EXPECT_GT(RedPixels(Image(camera, qpos), &moved), 800) << camera;
    if (camera == "head") {
      EXPECT_LT(moved, middle - 10);
    } else {
      EXPECT_GT(moved, middle + 10) << camera;
    }
  }
  qpos[pot] = 50;
  EXPECT_LT(RedPixels(Image("front", qpos)), 20);
}

TEST_F(RendererTest, WristCameraSeesItsOwnFingersOnly) {
  const std::vector<double> home = HomeQpos(model());
  std::vector<double> open = home;
  for (const char* finger : {"left/hand/finger_joint1", "left/hand/finger_joint2"}) {
    open[static_cast<size_t>(QposIndex(model(), finger))] = 0.04;
  }
  EXPECT_LT(Conforming(Image("left/hand/wrist", home), Image("left/hand/wrist", open)), 0.97);
  EXPECT_EQ(Conforming(Image("right/hand/wrist", home), Image("right/hand/wrist", open)), 1);
}

TEST_F(RendererTest, ShadowsAreDrawn) {
  // The counter next to the pot is darker where the pot blocks the key light. Without the pot it is not.
  std::vector<double> qpos = HomeQpos(model());
  const auto brightness = [&] {
    const Frame frame = Image("front", qpos);
    int dark = 0;
    for (size_t i = 0; i < frame.bgrx.size(); i += 4) {
      // Oak in the shade is brownish and below 150.
      const int r = frame.bgrx[i + 2], g = frame.bgrx[i + 1], b = frame.bgrx[i];
      dark += r > 70 && r < 150 && r > b + 25 && g > b && r < g + 45;
    }
    return dark;
  };
  const int with_pot = brightness();
  qpos[static_cast<size_t>(QposIndex(model(), "pot"))] = 50;
  EXPECT_GT(with_pot, brightness() + 200);
}

TEST_F(RendererTest, AnEpisodesColorsAreThoseOfItsSeed) {
  model_info_t info = scene_->info;
  info.variation = "green";
  info.task_yaml = WithVariation(info.task_yaml,
                                 "  green:\n    randomize:\n"
                                 "      - color: {of: [pot], min_rgb: [0, 0.2, 0], max_rgb: [0, 1, 0]}\n");
  const std::vector<double> home = HomeQpos(model());
  const Frame red = Image("front", home);
  renderer_->SetAppearance(info, 1);
  const Frame green = Image("front", home);
  EXPECT_LT(RedPixels(green), 20);
  renderer_->SetAppearance(info, 2);
  EXPECT_NE(Image("front", home).bgrx, green.bgrx);
  renderer_->SetAppearance(info, 1);
  EXPECT_EQ(Image("front", home).bgrx, green.bgrx);
  renderer_->SetAppearance(info, std::nullopt);
  EXPECT_EQ(Image("front", home).bgrx, red.bgrx);
  info.variation = "base";
  renderer_->SetAppearance(info, 1);
  EXPECT_EQ(Image("front", home).bgrx, red.bgrx);
}

TEST_F(RendererTest, UnknownCameraIsOneClearLine) {
  try {
    FindCamera(model(), "nowhere");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(
        error.what(),
        "no camera 'nowhere'; this scene has head, roboeval/external, front, overview, roboeval/head, "
        "roboeval/front, roboeval/left_wrist, left/hand/wrist, roboeval/right_wrist, right/hand/wrist");
  }
}

TEST_F(RendererTest, RefusesWhatItCannotDraw) {
  EXPECT_THROW(Renderer(Copy(*scene_->visual), {0, 240}), InputError);
  EXPECT_THROW(Renderer(Copy(*scene_->visual), {321, 240}), InputError);
  EXPECT_THROW(Renderer(Copy(*scene_->visual), {320, 100000}), InputError);
  EXPECT_THROW(renderer_->SetState(StateOf(std::vector<double>(3))), InputError);
}

// A bar along x is 3 m below a camera. At this distance, an image that is 240 pixels high shows 120 / tan(45
// degrees / 2) / 3 = 96.6 pixels per meter.
TEST(MocapBody, IsRenderedAtThePoseOfTheState) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "bar.xml";
  std::ofstream(file) << R"(<mujoco><worldbody>
    <camera name="above" pos="0 0 3" xyaxes="1 0 0 0 1 0" fovy="45"/>
    <body name="bar" mocap="true"><geom type="box" size="0.3 0.1 0.001" rgba="1 0 0 1"/></body>
    </worldbody></mujoco>)";
  char message[200] = "";
  ModelPtr model(mj_loadXML(file.c_str(), nullptr, message, sizeof message));
  ASSERT_TRUE(model) << message;
  Renderer renderer(Copy(*model), kGoldenSize);
  state_t state{};
  EXPECT_THROW(renderer.SetState(state), InputError);
  // Each case has a position, a rotation about z in half turns, and the expected red columns and rows.
  struct Case {
    double x, y, turn;
    int left, right, top, bottom;
  };
  for (const Case& c : {Case{0, 0, 0, 131, 189, 110, 130}, Case{-0.5, 0.2, 0, 83, 141, 91, 110},
                        Case{0.5, 0, 0.5, 199, 218, 91, 149}}) {
    const double half = c.turn * std::numbers::pi / 2;
    state.num_bodies = 2;
    state.body = {{{0, 0, 0}, {1, 0, 0, 0}}, {{c.x, c.y, 0}, {std::cos(half), 0, 0, std::sin(half)}}};
    renderer.SetState(state);
    Frame frame(kGoldenSize);
    renderer.Render(0, &frame);
    int left = kGoldenSize.width, right = 0, top = kGoldenSize.height, bottom = 0;
    for (int i = 0; i < kGoldenSize.width * kGoldenSize.height; ++i) {
      const uint8_t* pixel = &frame.bgrx[static_cast<size_t>(i) * 4];
      if (pixel[2] < 40 || pixel[2] < 3 * pixel[1]) continue;
      left = std::min(left, i % kGoldenSize.width);
      right = std::max(right, i % kGoldenSize.width);
      top = std::min(top, i / kGoldenSize.width);
      bottom = std::max(bottom, i / kGoldenSize.width);
    }
    EXPECT_NEAR(left, c.left, 1.5);
    EXPECT_NEAR(right, c.right, 1.5);
    EXPECT_NEAR(top, c.top, 1.5);
    EXPECT_NEAR(bottom, c.bottom, 1.5);
  }
}

}  // namespace evalbus::viz::renderer_test
