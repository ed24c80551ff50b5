// Implements `evalbus robots`, which lists robots, shows a robot as text and as an image, and checks robot
// descriptions.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "base/angles.h"
#include "base/errors.h"
#include "cli/commands/commands.h"
#include "cli/commands/scene_words.h"
#include "models/scene.h"
#include "policy_bridge/planning/plan.h"
#include "sim/world.h"

namespace evalbus::commands {
namespace {

struct RobotsOptions {
  const CLI::App* list = nullptr;
  const CLI::App* show = nullptr;
  const CLI::App* check = nullptr;
  // Robot to show or check; argument for FindRobot().
  std::string robot;
  ModelSources sources;
  ImageOptions image;
};

// Time for which `check` holds the robot at home, and within which a gripper must close or open, s.
constexpr double kSeconds = 1;
// Tolerance for rounding errors of distances, m.
constexpr double kRounding = 1e-8;
// Up to these limits, the robot counts as at rest.
constexpr double kMaxSag = 0.02;    // rad
constexpr double kMaxSpeed = 0.05;  // rad/s, mean over the joints in the last half of the time
// Fingers with less travel or less force cannot hold an object.
constexpr double kMinTravel = 0.9;
constexpr double kMinForce = 5;  // N
// Minimum clearance of the scripted experts' motions, except between links that are closer at home, m.
const double kPlanningClearance = policy::MotionLimits().clearance;

// A scene with only the robot.
struct Alone {
  explicit Alone(const RobotsOptions& options) : robot(LoadRobot(FindRobot(options.robot), options.sources)) {
    task.name = "robot";
    task.scene_file = ModelsFolder() / "props/scene_base.xml";
    scene = BuildScene(task, robot);
    scene.info.substeps = 1;
  }
  sim::World MakeWorld() const {
    sim::World world(scene.physics.get(), scene.info, robot, task, scene.info.substeps);
    world.Reset(0, {});
    return world;
  }
  double timestep() const { return scene.physics->opt.timestep; }

  RobotDescription robot;
  TaskDescription task;
  Scene scene;
};

int List(const RobotsOptions& options) {
  std::vector<Lines> rows = {{"ROBOT", "ARMS", "JOINTS", "MODELS"}};
  for (const std::filesystem::path& file : AllRobots()) {
    try {
      const RobotDescription robot = LoadRobot(file, options.sources);
      size_t joints = 0;
      for (const ArmDescription& arm : robot.arms) joints += arm.joints.size();
      rows.push_back({file.stem(), Joined(robot.arm_names()), std::to_string(joints), "found"});
    } catch (const InputError&) {
      rows.push_back(
          {file.stem(), "-", "-",
           fmt::format("unusable, 'evalbus robots check {}' prints the reason", file.stem().string())});
    }
  }
  PrintTable(rows);
  fmt::print("\n'evalbus run TASK --robot ROBOT' uses one, 'evalbus robots show' shows its details.\n");
  return 0;
}

std::string Degrees(double radians) { return fmt::format("{:.3g}", ToDegrees(radians)); }

int Show(const RobotsOptions& options) {
  Alone alone(options);
  const RobotDescription& robot = alone.robot;
  if (!options.image.file.empty()) {
    const sim::World world = alone.MakeWorld();
    state_t state{};
    world.Fill(&state);
    DrawScene(std::move(alone.scene.visual), state, options.image);
  }
  fmt::print("{}\n{}\n", robot.name, robot.file.string());
  for (size_t i = 0; i < robot.arms.size(); ++i) {
    const ArmDescription& arm = robot.arms[i];
    const GripperDescription& gripper = robot.grippers[i];
    const arm_info_t& info = alone.scene.info.arm[i];
    fmt::print("\n");
    PrintSection("Arm", {arm.name + " at " + PoseInWords(arm.base)});
    PrintSection("Model", {arm.model_file.string()});
    Lines joints;
    for (size_t j = 0; j < arm.joints.size(); ++j) {
      joints.push_back(fmt::format("{}  {} to {} degrees, home {}", arm.joints[j],
                                   Degrees(info.joint_lower_rad[j]), Degrees(info.joint_upper_rad[j]),
                                   Degrees(arm.home[j])));
    }
    PrintSection("Joints", joints);
    PrintSection("Gripper",
                 {gripper.model_file.empty() ? "part of the arm's model" : gripper.model_file.string()});
    PrintSection("Pads", {Joined(gripper.pad_bodies)});
    Lines cameras;
    const mjModel& model = *alone.scene.physics;
    for (int camera = 0; camera < model.ncam; ++camera) {
      const char* name = mj_id2name(&model, mjOBJ_CAMERA, camera);
      if (name && std::string(name).starts_with(arm.prefix())) cameras.emplace_back(name);
    }
    PrintSection("Cameras", {cameras.empty() ? "none" : Joined(cameras)});
  }
  if (!options.image.file.empty()) fmt::print("\nimage    {}\n", options.image.file.string());
  return 0;
}

action_t HomeAction(const RobotDescription& robot, double closing) {
  action_t action{};
  action.mode = action_t::JOINT_POSITION;
  for (const ArmDescription& arm : robot.arms) {
    action.joint_position_rad.insert(action.joint_position_rad.end(), arm.home.begin(), arm.home.end());
  }
  action.gripper_closing.assign(robot.arms.size(), closing);
  return action;
}

// Finds pairs of geoms that are closer than kPlanningClearance at home. A pair is wrong if it overlaps or
// belongs to different entities, such as two arms. For other pairs, adds the note that scripted experts do
// not check them.
void CheckHome(const Alone& alone, Lines* wrong, Lines* notes) {
  const ModelPtr model(mj_copyModel(nullptr, alone.scene.physics.get()));
  std::fill_n(model->geom_margin, model->ngeom, kPlanningClearance);
  const DataPtr data(mj_copyData(nullptr, model.get(), &alone.MakeWorld().data()));
  mj_forward(model.get(), data.get());
  const model_info_t& info = alone.scene.info;
  // A pair may have several contacts, of which the deepest or nearest one counts.
  std::map<std::pair<int, int>, double> nearest;
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    const auto [pair, is_new] = nearest.try_emplace({contact.geom1, contact.geom2}, contact.dist);
    pair->second = std::min(pair->second, contact.dist);
  }
  for (const auto& [geoms, distance] : nearest) {
    const auto entity = [&](int geom) { return info.body_entity[info.geom_body[geom]]; };
    const std::string pair = info.geom_name[geoms.first] + " and " + info.geom_name[geoms.second];
    const std::string apart = fmt::format("{} are {:.3g} mm apart at home", pair, 1000 * distance);
    if (distance < -kRounding) {
      wrong->push_back(fmt::format("{} overlap by {:.3g} mm at home", pair, -1000 * distance));
    } else if (entity(geoms.first) == entity(geoms.second)) {
      notes->push_back(apart + ": scripted experts do not check this pair for collisions");
    } else {
      wrong->push_back(apart +
                       fmt::format(", but scripted experts require {:.3g} mm", 1000 * kPlanningClearance));
    }
  }
}

void CheckRest(const Alone& alone, Lines* wrong, Lines* notes) {
  sim::World world = alone.MakeWorld();
  world.Apply(HomeAction(alone.robot, 0));
  const int steps = static_cast<int>(kSeconds / alone.timestep());
  std::vector<double> sag(alone.robot.arms.size()), speed(alone.robot.arms.size());
  state_t state{};
  for (int step = 0; step < steps; ++step) {
    if (!world.Step()) {
      wrong->push_back("the physics becomes unstable while holding home: " + world.instability());
      return;
    }
    if (step < steps / 2) continue;
    world.Fill(&state);
    for (size_t i = 0; i < alone.robot.arms.size(); ++i) {
      const ArmDescription& arm = alone.robot.arms[i];
      for (size_t j = 0; j < arm.home.size(); ++j) {
        sag[i] = std::max(sag[i], std::abs(state.arm[i].joint_position_rad[j] - arm.home[j]));
        speed[i] += std::abs(state.arm[i].joint_velocity_radps[j]) /
                    static_cast<double>(arm.home.size() * static_cast<size_t>(steps - steps / 2));
      }
    }
  }
  for (size_t i = 0; i < alone.robot.arms.size(); ++i) {
    const std::string line =
        fmt::format("{} holds its home position within {:.2g} mrad, mean joint speed {:.2g} rad/s",
                    alone.robot.arms[i].name, 1000 * sag[i], speed[i]);
    if (sag[i] > kMaxSag || speed[i] > kMaxSpeed) {
      wrong->push_back(line +
                       fmt::format(", expected at most {:g} mrad and {:g} rad/s", 1000 * kMaxSag, kMaxSpeed));
    } else {
      notes->push_back(line);
    }
  }
}

// Returns the mean force on the joints of half-open fingers that are commanded to close, N or N m.
double Press(const Alone& alone, const GripperDescription& gripper) {
  const mjModel* model = alone.scene.physics.get();
  const DataPtr data(mj_copyData(nullptr, model, &alone.MakeWorld().data()));
  double force = 0;
  for (const bool measured : {false, true}) {
    for (const std::string& joint : gripper.joints) {
      const int id = mj_name2id(model, mjOBJ_JOINT, (gripper.prefix() + joint).c_str());
      data->qpos[model->jnt_qposadr[id]] = (gripper.joint_open + gripper.joint_closed) / 2;
      if (measured) force += std::abs(data->qfrc_actuator[model->jnt_dofadr[id]]);
    }
    data->ctrl[mj_name2id(model, mjOBJ_ACTUATOR, (gripper.prefix() + gripper.actuator).c_str())] =
        gripper.command_closed;
    mj_forward(model, data.get());
  }
  return force / static_cast<double>(gripper.joints.size());
}

void CheckGrippers(const Alone& alone, Lines* wrong, Lines* notes) {
  sim::World world = alone.MakeWorld();
  const int steps = static_cast<int>(kSeconds / alone.timestep());
  state_t state{};
  const auto travel = [&](double closing) {
    world.Apply(HomeAction(alone.robot, closing));
    for (int step = 0; step < steps && world.Step(); ++step) {
    }
    world.Fill(&state);
    std::vector<double> done;
    for (const gripper_state_t& gripper : state.gripper) {
      done.push_back(closing > 0 ? 1 - gripper.opening : gripper.opening);
    }
    return done;
  };
  const std::vector<double> closed = travel(1), opened = travel(0);
  for (size_t i = 0; i < closed.size(); ++i) {
    const GripperDescription& gripper = alone.robot.grippers[i];
    const double press = Press(alone, gripper);
    const mjModel& model = *alone.scene.physics;
    const bool slides =
        model.jnt_type[mj_name2id(&model, mjOBJ_JOINT, (gripper.prefix() + gripper.joints[0]).c_str())] ==
        mjJNT_SLIDE;
    const bool is_weak = (slides && press < kMinForce) || closed[i] < kMinTravel || opened[i] < kMinTravel;
    const std::string line = fmt::format(
        "{}'s gripper closes by {:.0f} % and opens to {:.0f} % in {:.3g} s each, presses with "
        "{:.3g} {} per finger",
        gripper.arm, 100 * closed[i], 100 * opened[i], kSeconds, press, slides ? "N" : "N m");
    if (is_weak) {
      wrong->push_back(line + fmt::format(", expected at least {:g} %{}", 100 * kMinTravel,
                                          slides ? fmt::format(" and {:g} N", kMinForce) : ""));
    } else {
      notes->push_back(line);
    }
  }
}

int Check(const RobotsOptions& options) {
  const Alone alone(options);
  Lines wrong, notes;
  for (const std::string& warning : alone.scene.warnings) fmt::print(stderr, "warning: {}\n", warning);
  CheckHome(alone, &wrong, &notes);
  CheckRest(alone, &wrong, &notes);
  CheckGrippers(alone, &wrong, &notes);
  for (const std::string& note : notes) fmt::print("{}\n", note);
  if (!wrong.empty()) {
    for (size_t i = 1; i < wrong.size(); ++i) fmt::print(stderr, "error: {}\n", wrong[i - 1]);
    throw InputError(wrong.back());
  }
  fmt::print("{}: robot {} is valid\n", alone.robot.file.string(), alone.robot.name);
  return 0;
}

void AddOptions(CLI::App* app, RobotsOptions* options) {
  app->require_subcommand(1);
  CLI::App* list = app->add_subcommand("list", "list the robots in models/robots");
  CLI::App* show = app->add_subcommand("show", "show arms, joints, gripper and cameras as text, or an image");
  CLI::App* check =
      app->add_subcommand("check", "load a robot, hold it at home for a second, close and open its grippers");
  for (CLI::App* each : {show, check}) {
    each->add_option("robot", options->robot, "name of a robot in models/robots, or a YAML file")->required();
  }
  for (CLI::App* each : {list, show, check}) {
    AddModelSources(each, &options->sources.model_path, &options->sources.assets);
  }
  AddImageOptions(show, &options->image);
  options->list = list;
  options->show = show;
  options->check = check;
}

// Returns the exit code. Throws InputError or EnvironmentError.
int Robots(const RobotsOptions& options) {
  if (options.list->parsed()) return List(options);
  if (options.show->parsed()) return Show(options);
  return Check(options);
}

}  // namespace

Action AddRobots(CLI::App* app) { return ActionOf<RobotsOptions>(app, AddOptions, Robots); }

}  // namespace evalbus::commands
