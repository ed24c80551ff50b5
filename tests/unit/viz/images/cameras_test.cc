// Tests that every camera of every task shows objects and hands, and not, for example, the back of a shelf.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "models/scene.h"
#include "sim/world.h"
#include "viz/images/renderer.h"

namespace evalbus::viz::cameras_test {

constexpr FrameSize kSize{160, 120};

// Minimum number of pixels, of a frame's 19,200, that must show an object or a hand. The cubes of 4 cm are
// the smallest objects.
constexpr int kObjectPixels = 8;
constexpr int kHandPixels = 12;

struct Shown {
  TaskDescription task;
  Scene scene;
  state_t state{};
};

Shown Show(const std::string& name) {
  const TaskSelection selection = FindTask(name);
  Shown shown{.task = selection.task,
              .scene = BuildScene(selection.task, LoadRobot(selection.task.robot_file)),
              .state = {}};
  const RobotDescription robot = LoadRobot(selection.task.robot_file);
  sim::World world(shown.scene.physics.get(), shown.scene.info, robot, shown.task, 10);
  world.Reset(1, shown.task.variation(selection.variation));
  world.Fill(&shown.state);
  return shown;
}

// The subjects have pure colors; everything else is black.
using Color = std::array<float, 3>;
constexpr Color kColors[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 0}, {0, 1, 1}};

// Returns a model in which each of these bodies, with everything attached to it, has the color at its index.
ModelPtr Painted(const mjModel& visual, const std::vector<std::string>& names) {
  ModelPtr model(mj_copyModel(nullptr, &visual));
  // Only the white ambient light of the headlight remains.
  std::fill_n(model->light_specular, 3 * model->nlight, 0.0f);
  std::fill_n(model->light_diffuse, 3 * model->nlight, 0.0f);
  std::fill_n(model->vis.headlight.ambient, 3, 1.0f);
  std::vector<int> paint(static_cast<size_t>(model->nbody), -1);
  for (size_t i = 0; i < names.size(); ++i) {
    const int body = mj_name2id(&visual, mjOBJ_BODY, names[i].c_str());
    EXPECT_GE(body, 0) << names[i];
    paint[static_cast<size_t>(body)] = static_cast<int>(i);
  }
  for (int body = 1; body < model->nbody; ++body) {
    int& own = paint[static_cast<size_t>(body)];
    if (own < 0) own = paint[static_cast<size_t>(model->body_parentid[body])];
  }
  for (int geom = 0; geom < model->ngeom; ++geom) {
    const int own = paint[static_cast<size_t>(model->geom_bodyid[geom])];
    const Color color = own < 0 ? Color{0, 0, 0} : kColors[own];
    if (model->geom_matid[geom] >= 0) model->geom_rgba[4 * geom + 3] = 1;
    model->geom_matid[geom] = -1;
    std::copy(color.begin(), color.end(), model->geom_rgba + 4 * geom);
  }
  return model;
}

// Returns the number of pixels of this color, at any brightness.
int PixelsOf(const Frame& frame, const Color& color) {
  int count = 0;
  for (size_t i = 0; i < frame.bgrx.size(); i += 4) {
    bool is_it = true;
    for (size_t c = 0; c < 3; ++c) {
      const int value = frame.bgrx[i + 2 - c];
      is_it &= color[c] > 0 ? value > 60 : value < 20;
    }
    count += is_it;
  }
  return count;
}

// Returns the position of a body's origin in the image, from -1 to 1 horizontally and vertically.
std::array<double, 2> InFrame(const mjModel& model, const state_t& state, int camera, int body) {
  EXPECT_EQ(model.cam_bodyid[camera], 0) << "stands in the world";
  const double* p = state.body[static_cast<size_t>(body)].position_m;
  double offset[3], seen[3], axes[9];
  for (int i = 0; i < 3; ++i) offset[i] = p[static_cast<size_t>(i)] - model.cam_pos[3 * camera + i];
  mju_quat2Mat(axes, model.cam_quat + 4 * camera);
  for (int i = 0; i < 3; ++i)
    seen[i] = axes[i] * offset[0] + axes[3 + i] * offset[1] + axes[6 + i] * offset[2];
  const double half = std::tan(model.cam_fovy[camera] / 2 * std::acos(-1) / 180) * -seen[2];
  return {seen[0] / (half * kSize.width / kSize.height), seen[1] / half};
}

TEST(Cameras, EveryOneOfEveryTaskShowsTheAction) {
  for (const TaskDescription& family : AllTasks()) {
    for (const Variation& variation : family.variations) {
      // The cameras of other variations differ only by small shifts and rotations.
      if (&variation != &family.variations[0] && !variation.robot_base && variation.poses.empty() &&
          variation.cameras.empty() && variation.parts.empty()) {
        continue;
      }
      SCOPED_TRACE(family.name + "/" + variation.name);
      const Shown shown = Show(family.name + "/" + variation.name);
      const mjModel& visual = *shown.scene.visual;
      std::vector<std::string> sought = {"left/hand", "right/hand"};
      sought.insert(sought.end(), shown.task.objects.begin(), shown.task.objects.end());
      ASSERT_LE(sought.size(), std::size(kColors));
      Renderer renderer(Painted(visual, sought), kSize);
      renderer.SetState(shown.state);
      Frame frame(kSize);
      for (const std::string camera : {"overview", "front", "head"}) {
        SCOPED_TRACE(camera);
        const int id = FindCamera(visual, camera);
        renderer.Render(id, &frame);
        for (size_t i = 0; i < sought.size(); ++i) {
          const bool is_hand = i < 2;
          EXPECT_GE(PixelsOf(frame, kColors[i]), is_hand ? kHandPixels : kObjectPixels) << sought[i];
          const int body = mj_name2id(&visual, mjOBJ_BODY, sought[i].c_str());
          const auto [x, y] = InFrame(visual, shown.state, id, body);
          EXPECT_LT(std::max(std::abs(x), std::abs(y)), 0.95) << sought[i] << " at " << x << ", " << y;
        }
      }
      for (size_t i = 0; i < 2; ++i) {
        renderer.Render(FindCamera(visual, sought[i] + "/wrist"), &frame);
        EXPECT_GE(PixelsOf(frame, kColors[i]), kHandPixels) << sought[i] << " in its own camera";
      }
    }
  }
}

using Vector = std::array<double, 3>;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector Column(const double* matrix, int i) { return {matrix[i], matrix[3 + i], matrix[6 + i]}; }

void ExpectNear(const Vector& a, const Vector& b, double tolerance = 1e-6) {
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
}

// The numbers are from RoboEval's own configuration, as listed in docs/adding_a_task.md.
TEST(RoboEvalCameras, AreInEveryTaskWhereRoboEvalHasThem) {
  for (const TaskDescription& family : AllTasks()) {
    for (const Variation& variation : family.variations) {
      if (&variation != &family.variations[0] && !variation.robot_base) continue;
      SCOPED_TRACE(family.name + "/" + variation.name);
      const Shown shown = Show(family.name + "/" + variation.name);
      const mjModel& model = *shown.scene.visual;
      const DataPtr data(mj_makeData(&model));
      std::copy(shown.state.qpos_mixed.begin(), shown.state.qpos_mixed.end(), data->qpos);
      mj_kinematics(&model, data.get());
      mj_comPos(&model, data.get());
      mj_camlight(&model, data.get());
      const auto camera_of = [&](const std::string& name) {
        const int camera = FindCamera(model, "roboeval/" + name);
        EXPECT_EQ(model.cam_fovy[camera], 45) << name;
        return camera;
      };
      const auto place = [&](int camera) {
        return Vector{data->cam_xpos[3 * camera], data->cam_xpos[3 * camera + 1],
                      data->cam_xpos[3 * camera + 2]};
      };
      const auto right = [&](int camera) { return Column(data->cam_xmat + 9 * camera, 0); };
      const auto up = [&](int camera) { return Column(data->cam_xmat + 9 * camera, 1); };

      // The robots of all tasks face in the direction of x.
      const Pose& base = shown.task.robot_base;
      EXPECT_EQ(base.quaternion[0], 1);
      const int head = camera_of("head"), front = camera_of("front"), external = camera_of("external");
      ExpectNear(place(head), {base.position[0] - 0.4, base.position[1], base.position[2] + 1.35});
      // The image shows the robot's right on the right side. The camera points 30 degrees down.
      ExpectNear(right(head), {0, -1, 0}, 1e-3);
      ExpectNear(up(head), {0.5, 0, std::sqrt(0.75)}, 1e-3);
      ExpectNear(place(front), {base.position[0] + 1.4, base.position[1], base.position[2] + 1.6});
      ExpectNear(right(front), {0, 1, 0}, 1e-3);
      ExpectNear(up(front), {-0.5, 0, std::sqrt(0.75)}, 1e-3);
      // This camera is fixed in the world. It views the scene from the robot's right and points 45 degrees
      // down.
      ExpectNear(place(external), {0, -2, 3});
      ExpectNear(right(external), {1, 0, 0}, 1e-3);
      ExpectNear(up(external), {0, std::sqrt(0.5), std::sqrt(0.5)}, 1e-3);

      for (const std::string arm : {"left", "right"}) {
        SCOPED_TRACE(arm);
        const int wrist = camera_of(arm + "_wrist");
        const int site = mj_name2id(&model, mjOBJ_SITE, (arm + "/flange").c_str());
        const int joint = mj_name2id(&model, mjOBJ_JOINT, (arm + "/hand/finger_joint1").c_str());
        ASSERT_GE(site, 0);
        ASSERT_GE(joint, 0);
        const Vector approach = Column(data->site_xmat + 9 * site, 2);
        const Vector finger{data->xaxis[3 * joint], data->xaxis[3 * joint + 1], data->xaxis[3 * joint + 2]};
        Vector offset = place(wrist);
        for (size_t i = 0; i < 3; ++i) offset[i] -= data->site_xpos[3 * static_cast<size_t>(site) + i];
        // The camera is 7 cm beyond the flange and 5 cm to the side, along the hand's narrow side, which is
        // the image's x axis.
        EXPECT_NEAR(Dot(offset, approach), 0.07, 1e-6);
        EXPECT_NEAR(Dot(offset, right(wrist)), 0.05, 1e-6);
        EXPECT_NEAR(Dot(offset, finger), 0, 1e-6);
        // The camera points along the hand. The direction in which the fingers move is vertical in the image.
        const Vector back = Column(data->cam_xmat + 9 * wrist, 2);
        EXPECT_NEAR(Dot(back, approach), -1, 1e-6);
        EXPECT_NEAR(std::abs(Dot(up(wrist), finger)), 1, 1e-6);
        // Menagerie's frame "attachment" is our frame of joint 7 after a rotation of 135 degrees.
        const Vector x7 = Column(data->site_xmat + 9 * site, 0);
        EXPECT_NEAR(Dot(right(wrist), x7), -std::sqrt(0.5), 1e-6);
      }
    }
  }
}

TEST(RoboEvalCameras, AreOnTheSingleArm) {
  const TaskSelection selection = FindTask("cube_handover");
  const Scene scene = BuildScene(selection.task, LoadRobot(FindRobot("single_panda")));
  for (const std::string name : {"head", "front", "external", "left_wrist"}) {
    EXPECT_EQ(scene.visual->cam_fovy[FindCamera(*scene.visual, "roboeval/" + name)], 45) << name;
  }
}

TEST(Cameras, TheDefaultIsTheSameEverywhere) {
  // The script cannot include a C++ header, so this test compares its copy of the constant.
  std::ifstream file(EVALBUS_SOURCE_DIR "/run");
  std::stringstream script;
  script << file.rdbuf();
  EXPECT_NE(script.str().find("--video " + std::string(kDefaultCamera) + " "), std::string::npos);
}

}  // namespace evalbus::viz::cameras_test
