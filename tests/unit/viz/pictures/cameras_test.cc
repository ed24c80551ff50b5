// Every camera of every task shows what it is there for: objects and hands, not the back of a shelf.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "models/scene.h"
#include "sim/world.h"
#include "viz/pictures/renderer.h"

namespace evalbus::viz {
namespace {

constexpr FrameSize kSize{160, 120};

// Of the 19,200 pixels of a frame. The cubes of 4 cm are the smallest objects.
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

// What is looked for is painted: pure colours, everything else is black.
using Colour = std::array<float, 3>;
constexpr Colour kColours[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 0}, {0, 1, 1}};

// A model in which each of these bodies, with all that is attached to it, has the colour of its place.
ModelPtr Painted(const mjModel& visual, const std::vector<std::string>& names) {
  ModelPtr model(mj_copyModel(nullptr, &visual));
  // Nothing shines, and the lights are white.
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
    const Colour colour = own < 0 ? Colour{0, 0, 0} : kColours[own];
    if (model->geom_matid[geom] >= 0) model->geom_rgba[4 * geom + 3] = 1;
    model->geom_matid[geom] = -1;
    std::copy(colour.begin(), colour.end(), model->geom_rgba + 4 * geom);
  }
  return model;
}

// How many pixels have the colour, at any brightness.
int PixelsOf(const Frame& frame, const Colour& colour) {
  int count = 0;
  for (size_t i = 0; i < frame.bgrx.size(); i += 4) {
    bool is_it = true;
    for (size_t c = 0; c < 3; ++c) {
      const int value = frame.bgrx[i + 2 - c];
      is_it &= colour[c] > 0 ? value > 60 : value < 20;
    }
    count += is_it;
  }
  return count;
}

// Where the camera has a body's origin: from -1 to 1 across and up the frame.
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
      // Others differ in small shifts and turns alone.
      if (&variation != &family.variations[0] && !variation.robot_base && variation.poses.empty() &&
          variation.cameras.empty() && variation.parts.empty()) {
        continue;
      }
      SCOPED_TRACE(family.name + "/" + variation.name);
      const Shown shown = Show(family.name + "/" + variation.name);
      const mjModel& visual = *shown.scene.visual;
      std::vector<std::string> sought = {"left/hand", "right/hand"};
      sought.insert(sought.end(), shown.task.objects.begin(), shown.task.objects.end());
      ASSERT_LE(sought.size(), std::size(kColours));
      Renderer renderer(Painted(visual, sought), kSize);
      renderer.SetState(shown.state);
      Frame frame(kSize);
      for (const std::string camera : {"overview", "front", "head"}) {
        SCOPED_TRACE(camera);
        const int id = FindCamera(visual, camera);
        renderer.Render(id, &frame);
        for (size_t i = 0; i < sought.size(); ++i) {
          const bool is_hand = i < 2;
          EXPECT_GE(PixelsOf(frame, kColours[i]), is_hand ? kHandPixels : kObjectPixels) << sought[i];
          const int body = mj_name2id(&visual, mjOBJ_BODY, sought[i].c_str());
          const auto [x, y] = InFrame(visual, shown.state, id, body);
          EXPECT_LT(std::max(std::abs(x), std::abs(y)), 0.95) << sought[i] << " at " << x << ", " << y;
        }
      }
      for (size_t i = 0; i < 2; ++i) {
        renderer.Render(FindCamera(visual, sought[i] + "/wrist"), &frame);
        EXPECT_GE(PixelsOf(frame, kColours[i]), kHandPixels) << sought[i] << " in its own camera";
      }
    }
  }
}

TEST(Cameras, TheDefaultIsTheSameEverywhere) {
  // A script cannot include a header.
  std::ifstream file(EVALBUS_SOURCE_DIR "/run");
  std::stringstream script;
  script << file.rdbuf();
  EXPECT_NE(script.str().find("--video " + std::string(kDefaultCamera) + " "), std::string::npos);
}

}  // namespace
}  // namespace evalbus::viz
