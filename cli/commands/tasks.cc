// evalbus tasks: what there is to run, what a task is in words and as a picture, and whether a task file is
// right.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>

#include "base/errors.h"
#include "cli/commands/commands.h"
#include "metrics/task/task_evaluator.h"
#include "models/scene.h"
#include "sim/world.h"
#include "viz/pictures/png.h"
#include "viz/pictures/renderer.h"

namespace evalbus::commands {
namespace {

struct TasksOptions {
  const CLI::App* list = nullptr;
  const CLI::App* show = nullptr;
  const CLI::App* check = nullptr;
  // As FindTask takes it.
  std::string task;
  // Where to draw the scene as PNG; empty: nowhere.
  std::filesystem::path image;
  std::string camera = "overview";
  std::string size = "960x720";
  // Of the reset that is drawn.
  int64_t seed = 0;
  // To check.
  std::filesystem::path file;
};

// What `check` resets each variation from.
constexpr int kCheckedSeeds = 10;

using Lines = std::vector<std::string>;

// A task as one of its variations has it, composed.
struct Composed {
  explicit Composed(const TaskDescription& described)
      : task(described), robot(LoadRobot(task.robot_file)), scene(BuildScene(task, robot)) {
    scene.info.substeps = 1;
  }
  sim::World MakeWorld() const {
    return sim::World(scene.physics.get(), scene.info, robot, task, scene.info.substeps);
  }

  TaskDescription task;
  RobotDescription robot;
  Scene scene;
};

std::string Vector(const double* values, size_t size) {
  std::string text;
  for (size_t i = 0; i < size; ++i) text += fmt::format("{}{:.6g}", i == 0 ? "" : ", ", values[i]);
  return "(" + text + ")";
}

std::string InWords(const Pose& pose) {
  std::string text = Vector(pose.position.data(), 3) + " m";
  const auto& q = pose.quaternion;
  const double degrees = 180 / std::numbers::pi;
  if (q[1] != 0 || q[2] != 0) return text + ", quaternion " + Vector(q.data(), 4);
  const double yaw = 2 * std::atan2(q[3], q[0]) * degrees;
  return yaw == 0 ? text : text + fmt::format(", turned by {:.6g} degrees", yaw);
}

std::string Joined(const Lines& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string InWords(const SpawnBox& box) {
  std::string text = fmt::format("{} anywhere in x {:.6g} to {:.6g} m, y {:.6g} to {:.6g} m", box.object,
                                 box.center[0] - box.half_extents[0], box.center[0] + box.half_extents[0],
                                 box.center[1] - box.half_extents[1], box.center[1] + box.half_extents[1]);
  if (box.min_distance > 0) text += fmt::format(", at least {:.6g} m from other objects", box.min_distance);
  return text;
}

std::string InWords(const SpawnPlane& plane) {
  return fmt::format(
      "{} on a grid of pitch {:.6g} m over {:.6g} by {:.6g} m around {} m, each shifted by up to {} m",
      Joined(plane.objects), plane.spacing, 2 * plane.half_extents[0], 2 * plane.half_extents[1],
      Vector(plane.origin.data(), 3), Vector(plane.jitter.data(), 3));
}

std::string InWords(const SpawnYaw& yaw) {
  return fmt::format("{} turned about the vertical by up to {:.6g} degrees either way", yaw.object,
                     yaw.bound * 180 / std::numbers::pi);
}

std::string NamesOf(const std::vector<NamedExpression>& expressions) {
  Lines names;
  for (const NamedExpression& expression : expressions) {
    names.push_back(expression.name.empty() ? expression.expression.name : expression.name);
  }
  return Joined(names);
}

void PrintSection(const std::string& title, const Lines& lines) {
  std::string head = title;
  for (const std::string& line : lines) {
    fmt::print("{:<14}{}\n", head, line);
    head.clear();
  }
}

// Rows under a heading, columns as wide as their widest cell.
void PrintTable(const std::vector<Lines>& rows) {
  std::vector<size_t> widths(rows[0].size());
  for (const Lines& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const Lines& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}", row[i], widths[i] + 2);
    fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  }
}

int List() {
  std::vector<Lines> rows = {{"TASK", "VARIATION", "NAME IN ROBOEVAL", "STAGES", "ROBOTS"}};
  size_t families = 0;
  for (const TaskDescription& described : AllTasks()) {
    ++families;
    std::string name = described.name, robots = described.robot_file.stem().string();
    for (const OtherRobot& other : described.other_robots) robots += ", " + other.name;
    for (const Variation& variation : described.variations) {
      TaskDescription task = described;
      task.Apply(variation.name);
      rows.push_back({name, variation.name, variation.alias, std::to_string(task.stages.size()), robots});
      name.clear();
    }
  }
  PrintTable(rows);
  fmt::print(
      "\n{} variations of {} tasks. 'evalbus run TASK/VARIATION' runs one, 'evalbus tasks show' says what it "
      "is.\n",
      rows.size() - 1, families);
  return 0;
}

void Draw(Composed* composed, const Variation& variation, const TasksOptions& options) {
  const viz::FrameSize size = viz::ParseFrameSize(options.size);
  const int camera = viz::FindCamera(*composed->scene.visual, options.camera);
  sim::World world = composed->MakeWorld();
  world.Reset(options.seed, variation);
  state_t state{};
  world.Fill(&state);
  viz::Renderer renderer(std::move(composed->scene.visual), size);
  renderer.SetState(state);
  viz::Frame frame(size);
  renderer.Render(camera, &frame);
  viz::WritePng(frame, options.image);
}

int Show(const TasksOptions& options) {
  const TaskSelection selection = FindTask(options.task);
  Composed composed(selection.task);
  const TaskDescription& task = composed.task;
  const Variation& variation = task.variation(selection.variation);
  // First, so that nothing is printed if the picture cannot be drawn.
  if (!options.image.empty()) Draw(&composed, variation, options);

  fmt::print("{}/{}{}\n{}\n\n", task.name, variation.name,
             variation.alias.empty() ? "" : " (" + variation.alias + " in RoboEval)", task.title);
  Lines arms;
  for (const ArmDescription& arm : composed.robot.arms) arms.push_back(arm.name);
  PrintSection("Robot", {composed.robot.name + " (" + Joined(arms) + ") at " + InWords(task.robot_base)});
  PrintSection("Time limit", {fmt::format("{:.6g} s", task.time_limit)});

  Lines parts;
  size_t width = 0;
  for (const ScenePart& part : task.parts) width = std::max(width, part.name.size());
  for (const ScenePart& part : task.parts) {
    const bool is_object =
        std::find(task.objects.begin(), task.objects.end(), part.name) != task.objects.end();
    parts.push_back(fmt::format("{:<{}}  {}{}{}", part.name, width, InWords(part.pose),
                                is_object ? ", object of the task" : "", part.free ? ", free" : ""));
  }
  PrintSection("Scene", parts);

  Lines randomised;
  for (const Randomisation& randomisation : variation.randomisations) {
    randomised.push_back(std::visit([](const auto& spawn) { return InWords(spawn); }, randomisation));
  }
  PrintSection("At each reset", randomised.empty() ? Lines{"nothing is random"} : randomised);

  const ModelNames names(composed.scene.info);
  const metrics::CompileContext context{names, task};
  const auto describe = [&](const Expression& expression) {
    return metrics::CompilePredicate(expression, context)->Describe(true);
  };
  Lines stages;
  for (const Stage& stage : task.stages) {
    stages.push_back(fmt::format("{} {}", stage.index, stage.name));
    for (const std::string& line : describe(stage.when)) stages.push_back("    " + line);
  }
  PrintSection("Stages", stages);
  PrintSection("Success", describe(task.success));
  Lines failure;
  if (!task.failure.name.empty()) failure = describe(task.failure);
  PrintSection("Failure", failure.empty() ? Lines{"only if the robot leaves the place"} : failure);
  if (!task.target_distance.empty()) PrintSection("Distances", {NamesOf(task.target_distance)});
  if (!task.pose_error.empty()) PrintSection("Pose errors", {NamesOf(task.pose_error)});
  if (!options.image.empty()) PrintSection("Picture", {options.image.string()});
  return 0;
}

int Check(const std::filesystem::path& file) {
  const TaskDescription described = LoadTask(file);
  Lines names;
  for (const Variation& variation : described.variations) {
    TaskDescription task = described;
    task.Apply(variation.name);
    const Composed composed(task);
    if (names.empty()) {
      for (const std::string& warning : composed.scene.warnings) fmt::print(stderr, "warning: {}\n", warning);
    }
    const ModelNames model_names(composed.scene.info);
    const metrics::TaskEvaluator evaluator(composed.task, model_names);
    sim::World world = composed.MakeWorld();
    for (int seed = 0; seed < kCheckedSeeds; ++seed) world.Reset(seed, variation);
    names.push_back(variation.name);
  }
  fmt::print("{}: task {} is right; variations {}\n", file.string(), described.name, Joined(names));
  return 0;
}

void AddOptions(CLI::App* app, TasksOptions* options) {
  app->require_subcommand(1);
  options->list = app->add_subcommand("list", "a table of all tasks and variations");
  CLI::App* show = app->add_subcommand("show", "scene, randomisation, stages and verdict in words");
  show->add_option("task", options->task, "TASK[/VARIATION], RoboEval's name, or a YAML file")->required();
  show->add_option("--image", options->image, "draw the scene after a reset into this PNG file");
  show->add_option("--camera", options->camera, "camera of the picture")->capture_default_str();
  show->add_option("--size", options->size, "WIDTHxHEIGHT of the picture in pixels")->capture_default_str();
  show->add_option("--seed", options->seed, "seed of the reset")->capture_default_str();
  options->show = show;
  CLI::App* check = app->add_subcommand("check", "read a task file, compose and reset every variation");
  check->add_option("file", options->file, "YAML file of a task")->required();
  options->check = check;
}

// Returns the exit code. Throws InputError, EnvironmentError.
int Tasks(const TasksOptions& options) {
  if (options.list->parsed()) return List();
  if (options.show->parsed()) return Show(options);
  return Check(options.file);
}

}  // namespace

Action AddTasks(CLI::App* app) {
  const auto options = std::make_shared<TasksOptions>();
  AddOptions(app, options.get());
  return [options] { return Tasks(*options); };
}

}  // namespace evalbus::commands
