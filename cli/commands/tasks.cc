// Implements `evalbus tasks`, which lists tasks, shows a task as text and as an image, copies a task, and
// checks task files.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/angles.h"
#include "base/errors.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/commands/scene_words.h"
#include "collision/checker.h"
#include "collision/clearance_watch.h"
#include "collision/tick_contacts.h"
#include "lcmtypes/clock.h"
#include "metrics/task/task_evaluator.h"
#include "models/scene.h"
#include "models/task_family.h"
#include "sim/world.h"

namespace evalbus::commands {
namespace {

struct TasksOptions {
  const CLI::App* list = nullptr;
  const CLI::App* show = nullptr;
  const CLI::App* made = nullptr;
  const CLI::App* check = nullptr;
  // Task to show or copy; argument for FindTask().
  std::string task;
  // Value of --robot, as for 'evalbus run'; empty: the task's default robot.
  std::string robot;
  ModelSources sources;
  ImageOptions image;
  // Seed of the reset from which the image is rendered.
  int64_t seed = 0;
  // Task file to check.
  std::filesystem::path file;
  std::string new_name;
};

// Number of seeds from which `check` resets each variation.
constexpr int kCheckedSeeds = 10;

// A task and its composed scene.
struct Composed {
  explicit Composed(const TaskDescription& described, const std::string& other_robot = "",
                    const ModelSources& sources = {})
      : task(described),
        robot(LoadRobot(other_robot.empty() ? task.robot_file : FindRobot(other_robot), sources)) {
    task.FindAssets(sources);
    scene = BuildScene(task, robot);
    task.ApplyRobot(robot.name, robot.arm_names());
    scene.info.substeps = 1;
  }
  sim::World MakeWorld() const {
    return sim::World(scene.physics.get(), scene.info, robot, task, scene.info.substeps);
  }

  TaskDescription task;
  RobotDescription robot;
  Scene scene;
};

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
  return fmt::format("{} rotated about the vertical axis by up to {:.6g} degrees in either direction",
                     yaw.object, ToDegrees(yaw.bound));
}

std::string InWords(const SpawnJoint& spawn) {
  const double scale = spawn.is_angle ? ToDegrees(1) : 1;
  return fmt::format("joint {} anywhere from {:.6g} to {:.6g} {}", spawn.joint, spawn.min * scale,
                     spawn.max * scale, spawn.is_angle ? "degrees" : "m");
}

std::string InWords(const Distractors& distractors) {
  return fmt::format("{} to {} of {} in x {:.6g} to {:.6g} m, y {:.6g} to {:.6g} m", distractors.min_count,
                     distractors.max_count, Joined(distractors.objects),
                     distractors.center[0] - distractors.half_extents[0],
                     distractors.center[0] + distractors.half_extents[0],
                     distractors.center[1] - distractors.half_extents[1],
                     distractors.center[1] + distractors.half_extents[1]);
}

std::string JoinedNames(const std::vector<NameInFile>& names) {
  Lines texts;
  for (const NameInFile& name : names) texts.push_back(name.text);
  return Joined(texts);
}

std::string InWords(const Span& factor) {
  return fmt::format("times {:.6g} to {:.6g}", factor.min, factor.max);
}

std::string InWords(const RandomMass& mass) {
  return "mass of " + JoinedNames(mass.of) + " " + InWords(mass.factor);
}

std::string InWords(const RandomFriction& friction) {
  return "friction of " + JoinedNames(friction.of) + " " + InWords(friction.factor);
}

std::string InWords(const RandomColor& color) {
  return "color of " + JoinedNames(color.of) + " from " + Vector(color.min.data(), 3) + " to " +
         Vector(color.max.data(), 3);
}

std::string InWords(const RandomLight& light) {
  Lines changes;
  if (light.factor) changes.push_back("brightness " + InWords(*light.factor));
  if (light.shift) changes.push_back("shifted by up to " + Vector(light.shift->data(), 3) + " m");
  if (light.turn)
    changes.push_back(fmt::format("rotated by up to {:.6g} degrees about each axis", ToDegrees(*light.turn)));
  return "light " + light.name.text + ": " + Joined(changes);
}

std::string InWords(const RandomTexture& texture) {
  return "texture of " + JoinedNames(texture.of) + ": one of " + JoinedNames(texture.choices);
}

std::string InWords(const RandomCamera& camera) {
  return fmt::format(
      "camera {} shifted by up to {} m and rotated by up to {:.6g} degrees in either direction",
      camera.name.text, Vector(camera.shift.data(), 3), ToDegrees(camera.turn));
}

std::string NamesOf(const std::vector<NamedExpression>& expressions) {
  Lines names;
  for (const NamedExpression& expression : expressions) {
    names.push_back(expression.name.empty() ? expression.expression.name : expression.name);
  }
  return Joined(names);
}

int ListTasks() {
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
      "\n{} variations of {} tasks. 'evalbus run TASK/VARIATION' runs one, 'evalbus tasks show' shows "
      "its details.\n",
      rows.size() - 1, families);
  for (const std::string& assets : AssetNames()) {
    Lines names;
    for (const TaskDescription& task : TasksOfAssets(assets))
      names.push_back(assets + "/" + FamilyOf(task.name));
    if (!names.empty())
      fmt::print("\nThe same variations with --assets {}=FOLDER: {}\n", assets, Joined(names));
  }
  return 0;
}

void Draw(Composed* composed, const Variation& variation, const TasksOptions& options) {
  sim::World world = composed->MakeWorld();
  world.Reset(options.seed, variation);
  state_t state{};
  world.Fill(&state);
  composed->scene.info.variation = variation.name;
  DrawScene(std::move(composed->scene.visual), state, options.image, &composed->scene.info, options.seed);
}

int Show(const TasksOptions& options) {
  const TaskSelection selection = FindTask(options.task);
  Composed composed(selection.task, options.robot, options.sources);
  const TaskDescription& task = composed.task;
  const Variation& variation = task.variation(selection.variation);
  // The image is rendered first, so that nothing is printed if this fails.
  if (!options.image.file.empty()) Draw(&composed, variation, options);

  fmt::print("{}/{}{}\n{}\n\n", task.name, variation.name,
             variation.alias.empty() ? "" : " (" + variation.alias + " in RoboEval)", task.title);
  PrintSection("Robot", {composed.robot.name + " (" + Joined(composed.robot.arm_names()) + ") at " +
                         PoseInWords(task.robot_base)});
  if (!task.instruction.empty()) PrintSection("Instruction", {"\"" + task.instruction + "\""});
  PrintSection("Time limit", {fmt::format("{:.6g} s", task.time_limit)});

  Lines parts;
  size_t width = 0;
  for (const ScenePart& part : task.parts) width = std::max(width, part.name.size());
  for (const ScenePart& part : task.parts) {
    const bool is_object =
        std::find(task.objects.begin(), task.objects.end(), part.name) != task.objects.end();
    parts.push_back(fmt::format("{:<{}}  {}{}{}", part.name, width, PoseInWords(part.pose),
                                is_object ? ", task object" : "", part.free ? ", free" : ""));
  }
  PrintSection("Scene", parts);

  Lines randomized;
  const auto print_draws = [&](const auto& draws) {
    for (const auto& draw : draws)
      randomized.push_back(std::visit([](const auto& kind) { return InWords(kind); }, draw));
  };
  print_draws(variation.randomizations);
  for (const Distractors& distractors : variation.distractors) randomized.push_back(InWords(distractors));
  print_draws(variation.physics);
  print_draws(variation.appearance);
  PrintSection("At each reset", randomized.empty() ? Lines{"nothing is randomized"} : randomized);

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
  PrintSection("Failure", failure.empty() ? Lines{"only if the robot leaves the workspace"} : failure);
  if (!task.target_distance.empty()) PrintSection("Distances", {NamesOf(task.target_distance)});
  if (!task.pose_error.empty()) PrintSection("Pose errors", {NamesOf(task.pose_error)});
  if (!options.image.file.empty()) PrintSection("Image", {options.image.file.string()});
  return 0;
}

// Copies a task file and changes only its name.
int New(const TasksOptions& options) {
  const std::filesystem::path file = options.new_name + ".yaml";
  if (std::filesystem::exists(file)) throw InputError(file.string() + ": exists; choose another name");
  const TaskDescription old = FindTask(options.task).task;
  std::string text = old.text;
  const std::string line = "\nname: " + old.name + "\n";
  const size_t at = ("\n" + text).find(line);
  if (at == std::string::npos) {
    throw InputError(old.file.string() + ": no line 'name: " + old.name + "' that could be changed");
  }
  text.replace(at, line.size() - 1, "name: " + options.new_name + "\n");
  // The text is checked before the file is written, because the name may be invalid, and relative paths may
  // be wrong in the new folder.
  ParseTask(text, file, true);
  WriteWhole(file, text);
  fmt::print("{0}: a copy of {1}\n\n  evalbus tasks check {0}\n  evalbus run {0} --policy expert:{2}\n",
             file.string(), old.name, FamilyOf(old.name));
  return 0;
}

// Throws InputError if success or failure already holds in the reset state, because the verdict then does not
// depend on the policy.
void CheckUndecided(const sim::World& world, const Composed& composed, const Variation& variation, int seed,
                    collision::CollisionChecker* checker, metrics::TaskEvaluator* evaluator) {
  state_t state{};
  world.Fill(&state);
  contacts_t contacts{};
  collision::ClearanceWatch watch(checker, ControlPeriodUs(composed.scene.info));
  collision::FillContacts(state, checker, &watch, &contacts);
  evaluator->Start();
  for (const int tick : {0, 1}) evaluator->Evaluate({state, contacts.contact}, tick);
  if (evaluator->verdict() == metrics::Verdict::kUndecided) return;
  throw InputError(fmt::format(
      "{}: variation '{}': {} is already true after a reset with seed {}", variation.location.ToString(),
      variation.name, evaluator->verdict() == metrics::Verdict::kSuccess ? "success" : "failure", seed));
}

// Warns about entries of `other_robots` that name no robot in models/robots and no arms, because such an
// entry applies only to a robot of its name. Other robots keep the task's own target distances.
void WarnOfOtherRobots(const TaskDescription& task) {
  Lines known;
  for (const std::filesystem::path& robot : AllRobots()) known.push_back(robot.stem());
  for (const OtherRobot& other : task.other_robots) {
    if (!other.arms.empty() || std::ranges::count(known, other.name) > 0) continue;
    fmt::print(stderr, "warning: other_robots: no robot of evalbus has the name '{}'{}\n", other.name,
               Suggestion(other.name, known));
  }
}

int Check(const TasksOptions& options) {
  const std::filesystem::path& file = options.file;
  const TaskDescription described = LoadTask(file);
  WarnOfOtherRobots(described);
  Lines names;
  for (const Variation& variation : described.variations) {
    TaskDescription task = described;
    task.Apply(variation.name);
    Composed composed(task, options.robot, options.sources);
    if (names.empty()) {
      for (const std::string& warning : composed.scene.warnings) fmt::print(stderr, "warning: {}\n", warning);
    }
    const ModelNames model_names(composed.scene.info);
    metrics::TaskEvaluator evaluator(composed.task, model_names);
    collision::CollisionChecker checker(composed.scene.physics.get(), composed.scene.info);
    sim::World world = composed.MakeWorld();
    const std::vector<Parameter> seen = RandomizeAppearance(variation, 0, composed.scene.visual.get());
    for (int seed = 0; seed < kCheckedSeeds; ++seed) {
      std::vector<Parameter> parameters = world.Reset(seed, variation);
      parameters.insert(parameters.end(), seen.begin(), seen.end());
      CheckDistinct(parameters, variation);
      if (const std::string overlap = world.Overlap(); !overlap.empty()) {
        throw InputError(fmt::format("{}: variation '{}': after a reset with seed {}, {}",
                                     variation.location.ToString(), variation.name, seed, overlap));
      }
      CheckUndecided(world, composed, variation, seed, &checker, &evaluator);
    }
    names.push_back(variation.name);
  }
  fmt::print("{}: task {} is valid; variations: {}\n", file.string(), described.name, Joined(names));
  return 0;
}

void AddOptions(CLI::App* app, TasksOptions* options) {
  app->require_subcommand(1);
  options->list = app->add_subcommand("list", "list all tasks and variations");
  CLI::App* show = app->add_subcommand(
      "show", "show scene, randomization, stages and conditions as text, or an image of the scene");
  show->add_option("task", options->task, "TASK[/VARIATION], RoboEval's name, or a YAML file")->required();
  AddImageOptions(show, &options->image);
  show->add_option("--seed", options->seed, "seed of the reset")
      ->needs(show->get_option("--image"))
      ->capture_default_str();
  options->show = show;
  CLI::App* made = app->add_subcommand("new", "create a task file as a copy of another task's file");
  made->add_option("name", options->new_name, "name of the task; the file is NAME.yaml")->required();
  made->add_option("--from", options->task, "name or YAML file of the task to copy")->required();
  options->made = made;
  CLI::App* check = app->add_subcommand("check", "check a task file: compose and reset every variation");
  check->add_option("file", options->file, "YAML file of a task")->required();
  options->check = check;
  for (CLI::App* each : {show, check}) {
    each->add_option("--robot", options->robot,
                     "name or YAML file of a robot to use instead of the task's own");
    AddModelSources(each, &options->sources.model_path, &options->sources.assets);
  }
}

// Returns the exit code. Throws InputError or EnvironmentError.
int Tasks(const TasksOptions& options) {
  if (options.list->parsed()) return ListTasks();
  if (options.show->parsed()) return Show(options);
  if (options.made->parsed()) return New(options);
  return Check(options);
}

}  // namespace

Action AddTasks(CLI::App* app) { return ActionOf<TasksOptions>(app, AddOptions, Tasks); }

}  // namespace evalbus::commands
