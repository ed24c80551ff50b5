// Compares our own painter with MuJoCo's renderer pixel by pixel, for the same scene in the same buffer.
#include "viz/images/painter/scene_painter.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "models/scene.h"
#include "sim/world.h"
#include "tests/unit/temporary_folder.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::viz::scene_painter_test {

constexpr int kWidth = 320, kHeight = 240;

// Both painters compute the light at the vertices, but their shaders may round differently. Colors differ by
// at most this much, except at the edges of shadows, where a few pixels may be on the other side.
constexpr int kTolerance = 4;
constexpr double kDiffering = 0.002;

using Image = std::vector<uint8_t>;

double Differing(const Image& a, const Image& b) {
  int count = 0;
  for (size_t i = 0; i < a.size(); i += 3) {
    bool differs = false;
    for (size_t c = i; c < i + 3; ++c) differs |= std::abs(a[c] - b[c]) > kTolerance;
    count += differs;
  }
  return count / static_cast<double>(kWidth * kHeight);
}

void ExpectSame(const Image& ours, const Image& mujocos) { EXPECT_LE(Differing(ours, mujocos), kDiffering); }

// Returns whether the image shows anything, that is, has more than one color.
bool ShowsSomething(const Image& image) { return Differing(image, Image(image.size(), image[0])) > 0.02; }

// A model with its own OpenGL context.
class Stage {
 public:
  explicit Stage(ModelPtr model) : model_(std::move(model)) {
    model_->vis.global.offwidth = kWidth;
    model_->vis.global.offheight = kHeight;
    model_->vis.quality.offsamples = 0;
    data_.reset(mj_makeData(model_.get()));
    mjv_defaultScene(&scene_);
    mjr_defaultContext(&context_);
    mjv_defaultOption(&option_);
    mjv_defaultCamera(&camera_);
    camera_.type = mjCAMERA_FIXED;
    mjv_makeScene(model_.get(), &scene_, 2000);
    mjr_makeContext(model_.get(), &context_, mjFONTSCALE_50);
    mjr_setBuffer(mjFB_OFFSCREEN, &context_);
    painter_.emplace(context_, *model_, Look::kPlain);
    Move();
  }
  ~Stage() {
    gl_.MakeCurrent();
    kept_.clear();
    painter_.reset();
    mjr_freeContext(&context_);
    mjv_freeScene(&scene_);
  }

  mjModel& model() { return *model_; }
  mjData& data() { return *data_; }
  // Must be called after the coordinates in `data` have changed.
  void Move() {
    mj_kinematics(model_.get(), data_.get());
    mj_comPos(model_.get(), data_.get());
    mj_camlight(model_.get(), data_.get());
  }
  void set_shadows(bool shadows) { scene_.flags[mjRND_SHADOW] = shadows; }

  bool IsKnown(int camera) {
    Update(camera);
    return painter_->Supports(scene_);
  }
  Image Mujocos(int camera) {
    Update(camera);
    mjr_render(kView, &scene_, &context_);
    painter_->ForgetShadows();
    Image image(static_cast<size_t>(kWidth * kHeight) * 3);
    mjr_readPixels(image.data(), nullptr, kView, &context_);
    return image;
  }
  // Returns an image drawn from scratch, including the shadow map.
  Image Ours(int camera) {
    Update(camera);
    painter_->ForgetShadows();
    const auto image = painter_->NewImage(kWidth, kHeight);
    EXPECT_EQ(painter_->Paint(scene_, image.get()), (Part{0, 0, kWidth, kHeight}));
    return RgbOf(*image);
  }
  // Returns an image drawn from this camera's last image and the existing shadow map.
  Image UpToDate(int camera) {
    Update(camera);
    auto& kept = kept_[camera];
    if (!kept) kept = painter_->NewImage(kWidth, kHeight);
    last_part_ = painter_->Paint(scene_, kept.get());
    return RgbOf(*kept);
  }
  // Returns the fraction of the image that the last call of UpToDate() has redrawn.
  double last_share() const {
    return last_part_.is_empty() ? 0 : last_part_.width() * last_part_.height() / double{kWidth * kHeight};
  }

 private:
  static constexpr mjrRect kView{0, 0, kWidth, kHeight};

  void Update(int camera) {
    gl_.MakeCurrent();
    camera_.fixedcamid = camera;
    mjv_updateScene(model_.get(), data_.get(), &option_, nullptr, &camera_, mjCAT_ALL, &scene_);
  }
  static Image RgbOf(const PaintedImage& kept) {
    Image image;
    for (size_t i = 0; i < kept.rgba.size(); ++i) {
      if (i % 4 != 3) image.push_back(kept.rgba[i]);
    }
    return image;
  }

  GlContext gl_;
  ModelPtr model_;
  DataPtr data_;
  mjvScene scene_;
  mjrContext context_;
  mjvOption option_;
  mjvCamera camera_;
  std::optional<ScenePainter> painter_;
  std::map<int, std::unique_ptr<PaintedImage>> kept_;
  Part last_part_;
};

// Returns a scene with these `geoms` (MJCF), a floor, a sky and two lights, one of which casts shadows.
ModelPtr ModelWith(const std::string& geoms) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "scene.xml";
  std::ofstream(file) << R"(<mujoco>
    <visual><quality shadowsize="1024"/><map znear="0.01" zfar="20" shadowclip="2"/></visual>
    <statistic extent="1" center="0 0 0"/>
    <asset>
      <texture name="sky" type="skybox" builtin="gradient" rgb1=".4 .5 .6" rgb2="0 0 0" width="64" height="64"/>
      <texture name="squares" type="2d" builtin="checker" rgb1=".9 .2 .1" rgb2=".1 .2 .9" width="64" height="64"/>
      <texture name="cube" type="cube" builtin="gradient" rgb1=".9 .9 .1" rgb2=".1 .2 .9" width="64" height="64"/>
      <material name="squares" texture="squares" texrepeat="3 2"/>
      <material name="by_meter" texture="squares" texrepeat="3 2" texuniform="true"/>
      <material name="cube" texture="cube" shininess="0.8" specular="0.9"/>
      <material name="shining" rgba=".3 .8 .4 1" emission="0.3" shininess="0.2" specular="1"/>
      <mesh name="wedge" vertex="-.3 -.2 0  .3 -.2 0  .3 .2 0  -.3 .2 0  -.3 -.2 .4  -.3 .2 .4"/>
      <mesh name="painted" vertex="-.3 -.2 0  .3 -.2 0  0 .3 0  0 0 .5"
            face="0 2 1  0 1 3  1 2 3  2 0 3" texcoord="0 0  1 0  .5 1  .5 .5"/>
      <hfield name="hills" nrow="8" ncol="8" size=".5 .5 .2 .05"/>
    </asset>
    <worldbody>
      <light directional="true" pos="1 -1 3" dir="-.4 .4 -1" diffuse=".6 .6 .6" specular=".4 .4 .4"/>
      <light directional="true" castshadow="false" pos="-1 1 3" dir=".6 -.3 -.5" diffuse=".3 .3 .3"/>
      <camera name="side" pos="1.2 -1.2 1" xyaxes="1 1 0 -1 1 3" fovy="50"/>
      <camera name="above" pos="0 0 2" xyaxes="1 0 0 0 1 0" fovy="50"/>
      <geom type="plane" size="1 1 .1" rgba=".6 .6 .6 1"/>)"
                      << geoms << "</worldbody></mujoco>";
  char message[300] = "";
  ModelPtr model(mj_loadXML(file.c_str(), nullptr, message, sizeof message));
  EXPECT_TRUE(model) << message;
  if (model) {
    for (int i = 0; i < model->nhfielddata; ++i) {
      model->hfield_data[i] = 0.5f + 0.5f * std::sin(0.7f * static_cast<float>(i));
    }
  }
  return model;
}

struct Shape {
  const char* name;
  const char* geoms;
};

void PrintTo(const Shape& shape, std::ostream* out) { *out << shape.geoms; }

class ScenePainterShapes : public testing::TestWithParam<Shape> {};

TEST_P(ScenePainterShapes, AreAsMujocos) {
  ModelPtr model = ModelWith(GetParam().geoms);
  ASSERT_TRUE(model);
  Stage stage(std::move(model));
  const Image empty = Stage(ModelWith("")).Mujocos(0);
  for (const int camera : {0, 1}) {
    for (const bool shadows : {true, false}) {
      SCOPED_TRACE(fmt::format("camera {}, shadows {}", camera, shadows));
      stage.set_shadows(shadows);
      ASSERT_TRUE(stage.IsKnown(camera));
      const Image mujocos = stage.Mujocos(camera);
      if (camera == 0 && shadows) {
        EXPECT_GT(Differing(mujocos, empty), 0.01) << "the shape is not visible";
      }
      ExpectSame(stage.Ours(camera), mujocos);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    , ScenePainterShapes,
    testing::Values(
        Shape{"Sphere", R"(<geom type="sphere" size=".3" pos="0 0 .4" rgba=".8 .3 .2 1"/>)"},
        Shape{"Ellipsoid", R"(<geom type="ellipsoid" size=".4 .2 .1" pos="0 0 .4" euler="30 20 10"/>)"},
        Shape{"Capsule", R"(<geom type="capsule" size=".1 .3" pos="0 0 .4" euler="60 20 10"/>)"},
        Shape{"Cylinder", R"(<geom type="cylinder" size=".2 .3" pos="0 0 .4" euler="60 20 10"/>)"},
        Shape{"Box", R"(<geom type="box" size=".3 .2 .1" pos="0 0 .4" euler="30 20 10"/>)"},
        Shape{"Plane",
              R"(<geom type="plane" size=".3 .2 .1" pos="0 0 .4" euler="30 20 10" rgba="1 0 0 1"/>)"},
        Shape{"PlaneFromBehind",
              R"(<geom type="plane" size=".4 .3 .1" pos="0 0 .4" euler="150 0 40" rgba="1 0 0 1"/>)"},
        Shape{"Mesh", R"(<geom type="mesh" mesh="wedge" pos="0 0 .2" euler="0 0 20"/>)"},
        Shape{"HeightField", R"(<geom type="hfield" hfield="hills" pos="0 0 .1"/>)"},
        Shape{"TextureOnBox",
              R"(<geom type="box" size=".3 .2 .1" pos="0 0 .4" euler="0 0 20" material="squares"/>)"},
        Shape{"TextureByTheMeter",
              R"(<geom type="box" size=".3 .2 .1" pos="0 0 .4" euler="0 0 20" material="by_meter"/>)"},
        Shape{"TextureOnPlane",
              R"(<geom type="plane" size=".5 .3 .1" pos="0 0 .1" euler="10 0 20" material="squares"/>)"},
        Shape{"TextureByTheMeterOnPlane",
              R"(<geom type="plane" size=".5 .3 .1" pos="0 0 .1" euler="10 0 20" material="by_meter"/>)"},
        Shape{"TextureOfMesh", R"(<geom type="mesh" mesh="painted" pos="0 0 .2" material="squares"/>)"},
        Shape{"TextureOfMeshWithoutPlaces",
              R"(<geom type="mesh" mesh="wedge" pos="0 0 .2" material="squares"/>)"},
        Shape{"CubeTexture", R"(<geom type="sphere" size=".3" pos="0 0 .4" material="cube"/>
                                <geom type="box" size=".2 .1 .1" pos=".6 0 .3" material="cube"/>)"},
        Shape{"Emission", R"(<geom type="ellipsoid" size=".4 .2 .1" pos="0 0 .4" material="shining"/>)"},
        Shape{"Transparent", R"(<geom type="box" size=".2 .2 .2" pos="0 0 .4" rgba="1 0 0 .4"/>
                                <geom type="sphere" size=".2" pos="-.3 .3 .4" rgba="0 1 0 .6"/>
                                <geom type="box" size=".1 .1 .1" pos="-.5 .6 .2" rgba="0 0 1 1"/>)"},
        Shape{"BesideTheMap", R"(<geom type="box" size=".3 .3 .3" pos="3.5 0 .4" euler="0 0 20"/>
                                 <geom type="box" size=".2 .2 .2" pos="0 0 .4"/>)"}),
    [](const auto& shape) { return shape.param.name; });

// A flying ball, and a camera that moves along with it.
constexpr char kFlyingBall[] = R"(<body name="ball" pos="0 0 .5"><freejoint/>
    <camera name="rider" pos="0 -.8 .3" xyaxes="1 0 0 0 .3 1" fovy="60"/>
    <geom type="sphere" size=".15" rgba=".9 .2 .1 1"/></body>)";

TEST(ScenePainter, WhatMovesTakesItsShadowAlong) {
  Stage stage(ModelWith(kFlyingBall));
  ASSERT_EQ(stage.model().nq, 7);
  Image before;
  for (const double x : {-0.4, 0.0, 0.5}) {
    stage.data().qpos[0] = x;
    stage.Move();
    for (int camera = 0; camera < 3; ++camera) {
      SCOPED_TRACE(fmt::format("ball at {}, camera {}", x, camera));
      // Our image is drawn first. Otherwise, MuJoCo's shadow map of this state would hide the fault that our
      // map still belongs to the previous state.
      const Image ours = stage.Ours(camera);
      ExpectSame(ours, stage.Mujocos(camera));
    }
    const Image now = stage.Ours(1);
    if (!before.empty()) {
      EXPECT_GT(Differing(now, before), 0.01);
    }
    before = now;
  }
}

TEST(ScenePainter, WhatHasChangedIsDrawnAgain) {
  Stage stage(ModelWith(kFlyingBall));
  const auto expect_right = [&](int camera) { EXPECT_EQ(stage.UpToDate(camera), stage.Ours(camera)); };
  for (int camera = 0; camera < 3; ++camera) expect_right(camera);
  stage.UpToDate(1);
  EXPECT_EQ(stage.last_share(), 0) << "nothing has changed";
  // Cameras alternate, so each camera has missed changes that others have drawn. Some changes are reversed.
  double largest = 0;
  for (const auto& [x, camera] : std::initializer_list<std::pair<double, int>>{
           {0.1, 0}, {0.2, 1}, {0.2, 2}, {0, 0}, {-0.4, 1}, {0.2, 1}, {0.2, 0}, {0.3, 2}, {0.3, 1}}) {
    SCOPED_TRACE(fmt::format("ball at {}, camera {}", x, camera));
    stage.data().qpos[0] = x;
    stage.Move();
    expect_right(camera);
    if (camera == 1) largest = std::max(largest, stage.last_share());
  }
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 0.5);
  // Changes a color, disables and enables shadows, and rotates a light.
  stage.model().geom_rgba[4 * 1] = 0.1f;
  expect_right(1);
  EXPECT_GT(stage.last_share(), 0);
  stage.set_shadows(false);
  expect_right(1);
  stage.set_shadows(true);
  expect_right(1);
  stage.model().light_dir[0] = 0.3;
  stage.Move();
  expect_right(1);
  EXPECT_EQ(stage.last_share(), 1);
}

// A ball flies over a table, under it and behind it. Only the parts that boxes hide from the light or from
// the camera remain unchanged.
TEST(ScenePainter, WhatBoxesHideNeedsNoDrawing) {
  Stage stage(ModelWith(std::string(kFlyingBall) + R"(
    <geom type="box" size=".5 .4 .02" pos="0 0 .4" rgba=".7 .6 .4 1"/>
    <geom type="box" size=".02 .3 .2" pos=".3 0 .2" euler="0 0 30"/>
    <geom type="box" size=".3 .02 .3" pos="-.2 -.5 .3" euler="0 10 20"/>
    <geom type="box" size=".1 .1 .05" pos="0 .2 .47" rgba=".2 .6 .9 .4"/>
    <geom type="capsule" size=".05 .2" pos=".2 .2 .5" euler="90 0 0"/>
    <geom type="mesh" mesh="wedge" pos="-.4 .3 .1"/>)"));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> across(-0.7, 0.7), up(0.1, 1.2);
  double share = 0;
  constexpr int kMoves = 60;
  for (int move = 0; move < kMoves; ++move) {
    double* const q = stage.data().qpos;
    q[0] = across(random);
    q[1] = across(random);
    q[2] = up(random);
    stage.Move();
    for (const int camera : {0, 1}) {
      SCOPED_TRACE(fmt::format("move {}, camera {}", move, camera));
      const Image kept = stage.UpToDate(camera);
      share += stage.last_share() / (2 * kMoves);
      ASSERT_EQ(kept, stage.Ours(camera));
    }
  }
  EXPECT_LT(share, 0.7);
}

TEST(ScenePainter, LeavesToMujocoWhatItDoesNotKnow) {
  const char* const unknown[] = {
      R"(<light pos="0 0 3" dir="0 0 -1"/>)",
      R"(<light directional="true" pos="0 0 3" dir="0 0 -1"/>)",
      R"(<geom type="plane" size="0 0 .1" pos="0 0 -.1"/>)",
  };
  for (const char* geoms : unknown) EXPECT_FALSE(Stage(ModelWith(geoms)).IsKnown(0)) << geoms;
  EXPECT_TRUE(Stage(ModelWith("")).IsKnown(0));
}

// Every camera of one variation of each task is compared, at the beginning of an episode and after arms and
// objects have moved.
TEST(ScenePainter, DrawsEveryTaskAsMujocoDoes) {
  for (const TaskDescription& family : AllTasks()) {
    SCOPED_TRACE(family.name);
    const TaskSelection selection = FindTask(family.name);
    const RobotDescription robot = LoadRobot(selection.task.robot_file);
    const Scene scene = BuildScene(selection.task, robot);
    sim::World world(scene.physics.get(), scene.info, robot, selection.task, 10);
    world.Reset(1, selection.task.variation(selection.variation));
    state_t state{};
    world.Fill(&state);
    Stage stage(ModelPtr(mj_copyModel(nullptr, scene.visual.get())));
    mjModel& model = stage.model();
    std::copy(state.qpos_mixed.begin(), state.qpos_mixed.end(), stage.data().qpos);
    for (int body = 0; body < model.nbody; ++body) {
      if (model.body_mocapid[body] < 0) continue;
      const auto& pose = state.body[static_cast<size_t>(body)];
      mju_copy3(stage.data().mocap_pos + 3 * model.body_mocapid[body], pose.position_m);
      mju_copy4(stage.data().mocap_quat + 4 * model.body_mocapid[body], pose.quat_wxyz);
    }
    for (const bool moved : {false, true}) {
      for (int joint = 0; joint < model.njnt && moved; ++joint) {
        double* const q = stage.data().qpos + model.jnt_qposadr[joint];
        if (model.jnt_type[joint] == mjJNT_FREE) {
          q[1] += 0.1;
          q[2] += 0.05;
        } else if (model.jnt_type[joint] == mjJNT_HINGE) {
          q[0] += 0.15;
        }
      }
      stage.Move();
      // Draws all of evalbus' images with one shadow map first. MuJoCo then draws a map for each image.
      std::vector<Image> ours;
      for (int camera = 0; camera < model.ncam; ++camera) {
        ASSERT_TRUE(stage.IsKnown(camera));
        ours.push_back(stage.UpToDate(camera));
      }
      for (int camera = 0; camera < model.ncam; ++camera) {
        SCOPED_TRACE(fmt::format("camera {}, moved {}", mj_id2name(&model, mjOBJ_CAMERA, camera), moved));
        const Image& image = ours[static_cast<size_t>(camera)];
        EXPECT_TRUE(ShowsSomething(image));
        ExpectSame(image, stage.Mujocos(camera));
        EXPECT_EQ(image, stage.Ours(camera));
      }
    }
  }
}

}  // namespace evalbus::viz::scene_painter_test
