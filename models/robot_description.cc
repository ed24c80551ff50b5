#include "models/robot_description.h"

#include <algorithm>
#include <cctype>

#include "base/errors.h"
#include "base/input_file.h"
#include "models/mjcf_file.h"
#include "models/task_description.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// Searches for a file in `sources`, whose model_path also contains the folders that are always searched.
std::filesystem::path FindModelFile(const YamlValue& value, const ModelSources& sources) {
  if (IsAssetFile(value.Text())) return AssetFile(value.Text(), value.location(), sources);
  std::string looked_in;
  for (const std::filesystem::path& folder : sources.model_path) {
    const std::filesystem::path file = (folder / value.Text()).lexically_normal();
    if (std::filesystem::is_regular_file(file)) return file;
    looked_in += (looked_in.empty() ? "" : ", ") + folder.string();
  }
  value.Fail("file '" + value.Text() + "' not found in " + looked_in +
             "; --model-path FOLDER names further folders");
}

// Returns the text of `value`, which must be one of `names`.
std::string NameIn(const YamlValue& value, const std::set<std::string>& names, const std::string& what,
                   const std::filesystem::path& file) {
  const std::string name = value.Text();
  if (!names.contains(name)) {
    value.Fail(file.filename().string() + " has no " + what + " '" + name + "'" +
               Suggestion(name, {names.begin(), names.end()}));
  }
  return name;
}

std::vector<std::string> NamesFrom(const YamlValue& value, const std::set<std::string>& names,
                                   const std::string& what, const std::filesystem::path& file) {
  std::vector<std::string> result;
  for (const YamlValue& element : value.List()) {
    const std::string name = NameIn(element, names, what, file);
    if (std::find(result.begin(), result.end(), name) != result.end())
      element.Fail("'" + name + "' given twice");
    result.push_back(name);
  }
  if (result.empty()) value.Fail("expected at least one " + what);
  return result;
}

std::vector<double> OptionalNumbers(const YamlMap& map, const std::string& key, size_t size,
                                    NumberRange range) {
  const YamlValue* value = map.Find(key);
  return value ? value->Numbers(size, range) : std::vector<double>();
}

// Reads the joint positions of the open and of the closed gripper, from keys that end in _m (slide joints) or
// in _rad (hinge joints).
void ReadTravel(const YamlMap& map, GripperDescription* gripper) {
  const std::string open = "joint_open", closed = "joint_closed";
  const auto has = [&](const char* unit) { return map.Find(open + unit) && map.Find(closed + unit); };
  const bool is_slide = has("_m");
  const std::string unit = is_slide ? "_m" : "_rad", other = is_slide ? "_rad" : "_m";
  if (is_slide == has("_rad") || map.Find(open + other) || map.Find(closed + other)) {
    map.value().Fail(
        "expected either 'joint_open_m' and 'joint_closed_m', or 'joint_open_rad' and 'joint_closed_rad'");
  }
  gripper->is_slide = is_slide;
  gripper->joint_open = map[open + unit].Number();
  gripper->joint_closed = map[closed + unit].Number();
}

void ReadStand(const YamlValue& value, const ModelSources& sources, ArmDescription* arm) {
  const YamlMap map(value, {"model"}, {"pose"});
  arm->stand_file = FindModelFile(map["model"], sources);
  if (const YamlValue* pose = map.Find("pose")) arm->stand_pose = ReadPose(*pose);
}

// Bodies of an arm and its hand, named without the arm's prefix.
std::set<std::string> BodiesOf(const MjcfFile& arm_model, const GripperDescription& gripper) {
  std::set<std::string> names = NamesIn(arm_model, "worldbody", "body");
  if (gripper.model_file.empty()) return names;
  names.insert("hand");
  for (const std::string& name : NamesIn(ReadMjcf(gripper.model_file), "worldbody", "body")) {
    names.insert("hand/" + name);
  }
  return names;
}

std::vector<std::array<std::string, 2>> ReadExcludes(const YamlValue& value,
                                                     const std::set<std::string>& bodies,
                                                     const std::filesystem::path& file) {
  std::vector<std::array<std::string, 2>> excludes;
  for (const YamlValue& pair : value.List()) {
    const std::vector<std::string> names = NamesFrom(pair, bodies, "body", file);
    if (names.size() != 2) pair.Fail("expected the names of two bodies, got " + std::to_string(names.size()));
    excludes.push_back({names[0], names[1]});
  }
  return excludes;
}

// Returns a name in the composed scene, which may have a prefix: "roboeval/head".
std::string SceneName(const YamlValue& value) {
  const std::string name = value.Text();
  const auto is_good = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '/'; };
  if (!std::isalpha(static_cast<unsigned char>(name[0])) || !std::ranges::all_of(name, is_good)) {
    value.Fail(
        "expected a name that begins with a letter and contains only letters, digits, '_' and '/', got '" +
        name + "'");
  }
  return name;
}

CameraDescription ReadCamera(const YamlMap& map, const std::string& name,
                             const std::vector<CameraDescription>& others) {
  CameraDescription camera;
  camera.name = name;
  for (const CameraDescription& other : others) {
    if (other.name == name) map["name"].Fail("another camera has the name '" + name + "'");
  }
  camera.pose = ReadPose(map["pose"]);
  if (const YamlValue* fov = map.Find("vertical_fov_deg")) {
    camera.vertical_fov = fov->Number({.min = 1, .max = 170});
  }
  return camera;
}

std::vector<CameraDescription> ReadArmCameras(const YamlValue& value, const std::set<std::string>& bodies,
                                              const std::filesystem::path& file) {
  std::vector<CameraDescription> cameras;
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {"name", "body", "pose"}, {"vertical_fov_deg"});
    cameras.push_back(ReadCamera(map, map["name"].Name(), cameras));
    cameras.back().body = NameIn(map["body"], bodies, "body", file);
  }
  return cameras;
}

std::vector<CameraDescription> ReadRobotCameras(const YamlValue& value, const std::set<std::string>& bodies,
                                                const std::filesystem::path& file) {
  std::vector<CameraDescription> cameras;
  for (const YamlValue& entry : value.List()) {
    const YamlMap map(entry, {"name", "pose"}, {"body", "vertical_fov_deg"});
    cameras.push_back(ReadCamera(map, SceneName(map["name"]), cameras));
    if (const YamlValue* body = map.Find("body")) cameras.back().body = NameIn(*body, bodies, "body", file);
  }
  return cameras;
}

GripperDescription ReadGripper(const YamlValue& value, const ArmDescription& arm, const MjcfFile& arm_model,
                               const ModelSources& sources) {
  const YamlMap map(value, {"joints", "actuator", "command_open", "command_closed", "pad_bodies"},
                    {"model", "attach_body", "mount", "joint_open_m", "joint_open_rad", "joint_closed_m",
                     "joint_closed_rad", "start_opening", "binary_command", "joint_damping_Ns_per_m",
                     "position_gain_N_per_m", "position_gain_Nm_per_rad"});
  GripperDescription gripper;
  gripper.arm = arm.name;
  gripper.location = value.location();

  // The gripper has its own model or is part of the arm's model.
  MjcfFile own_model;
  const MjcfFile* model = &arm_model;
  if (const YamlValue* file = map.Find("model")) {
    gripper.model_file = FindModelFile(*file, sources);
    own_model = ReadMjcf(gripper.model_file);
    model = &own_model;
    const YamlValue* body = map.Find("attach_body");
    if (!body) value.Fail("a gripper with its own model requires 'attach_body'");
    gripper.attach_body = NameIn(*body, NamesIn(arm_model, "worldbody", "body"), "body", arm_model.file);
    if (const YamlValue* mount = map.Find("mount")) gripper.mount = ReadPose(*mount);
  } else {
    for (const char* key : {"attach_body", "mount"}) {
      if (const YamlValue* useless = map.Find(key)) useless->Fail("requires 'model'");
    }
  }

  gripper.joints = NamesFrom(map["joints"], NamesIn(*model, "worldbody", "joint"), "joint", model->file);
  ReadTravel(map, &gripper);
  if (gripper.joint_open == gripper.joint_closed) value.Fail("joint_open and joint_closed must differ");
  if (const YamlValue* damping = map.Find("joint_damping_Ns_per_m")) {
    gripper.joint_damping = damping->Number(kNotNegative);
  }
  for (const char* key : {"position_gain_N_per_m", "position_gain_Nm_per_rad"}) {
    const YamlValue* gain = map.Find(key);
    if (gain && gripper.position_gain > 0) gain->Fail("give either this or 'position_gain_N_per_m'");
    if (gain) gripper.position_gain = gain->Number(kPositive);
  }
  gripper.actuator = NameIn(map["actuator"], NamesIn(*model, "actuator", "*"), "actuator", model->file);
  gripper.command_open = map["command_open"].Number();
  gripper.command_closed = map["command_closed"].Number();
  if (gripper.command_open == gripper.command_closed) {
    map["command_closed"].Fail("must differ from command_open");
  }
  if (const YamlValue* opening = map.Find("start_opening")) {
    gripper.start_opening = opening->Number({.min = 0, .max = 1});
  }
  if (const YamlValue* binary = map.Find("binary_command")) gripper.binary_command = binary->Bool();
  gripper.pad_bodies =
      NamesFrom(map["pad_bodies"], NamesIn(*model, "worldbody", "body"), "body", model->file);
  return gripper;
}

}  // namespace

std::vector<std::string> RobotDescription::arm_names() const {
  std::vector<std::string> names;
  for (const ArmDescription& arm : arms) names.push_back(arm.name);
  return names;
}

std::vector<std::filesystem::path> AllRobots() {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(ModelsFolder() / "robots", error)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::filesystem::path FindRobot(const std::string& name) {
  const std::filesystem::path file(name);
  if (file.extension() == ".yaml" || file.extension() == ".yml") return file;
  std::vector<std::string> known;
  for (const std::filesystem::path& robot : AllRobots()) {
    if (robot.stem() == name) return robot;
    known.push_back(robot.stem());
  }
  throw InputError("unknown robot '" + name + "'" + Suggestion(name, known));
}

RobotDescription LoadRobot(const std::filesystem::path& file, const ModelSources& sources) {
  const YamlMap map(ParseYaml(ReadInput(file, "robot description"), file.string()), {"name", "arms"},
                    {"cameras", "gravity_compensation", "start_steps"});

  RobotDescription robot;
  robot.name = map["name"].Name();
  robot.file = std::filesystem::absolute(file).lexically_normal();
  if (const YamlValue* compensation = map.Find("gravity_compensation")) {
    robot.gravity_compensation = compensation->Bool();
  }
  if (const YamlValue* steps = map.Find("start_steps")) robot.start_steps = steps->Integer(0, 1000);
  ModelSources all{.model_path = {robot.file.parent_path()}, .assets = sources.assets};
  for (const auto& folder : sources.model_path)
    all.model_path.push_back(std::filesystem::absolute(folder).lexically_normal());
  const std::filesystem::path shipped = ModelsFolder() / "robots";
  if (std::ranges::find(all.model_path, shipped) == all.model_path.end()) all.model_path.push_back(shipped);

  // Bodies of all arms, named as in the scene.
  std::set<std::string> all_bodies;
  for (const YamlValue& entry : map["arms"].List()) {
    const YamlMap arm_map(entry,
                          {"name", "model", "joints", "actuators", "wrist_site", "home_rad", "gripper"},
                          {"base", "position_gain_Nm_per_rad", "joint_damping_Nms_per_rad", "armature_kgm2",
                           "stand", "excludes", "cameras", "keep_lights"});
    ArmDescription arm;
    arm.location = entry.location();
    arm.name = arm_map["name"].Name();
    for (const char* meaning : {"all", "any", "first", "other"}) {
      if (arm.name == meaning)
        arm_map["name"].Fail("conditions of tasks use '" + arm.name + "' for other arms");
    }
    for (const ArmDescription& other : robot.arms) {
      if (other.name == arm.name) arm_map["name"].Fail("another arm has the name '" + arm.name + "'");
    }
    arm.model_file = FindModelFile(arm_map["model"], all);
    const MjcfFile model = ReadMjcf(arm.model_file);
    if (const YamlValue* base = arm_map.Find("base")) arm.base = ReadPose(*base);

    arm.joints = NamesFrom(arm_map["joints"], NamesIn(model, "worldbody", "joint"), "joint", model.file);
    const size_t n = arm.joints.size();
    arm.actuators = NamesFrom(arm_map["actuators"], NamesIn(model, "actuator", "*"), "actuator", model.file);
    if (arm.actuators.size() != n) {
      arm_map["actuators"].Fail("expected one per joint, " + std::to_string(n) + ", got " +
                                std::to_string(arm.actuators.size()));
    }
    arm.wrist_site = NameIn(arm_map["wrist_site"], NamesIn(model, "worldbody", "site"), "site", model.file);
    arm.home = arm_map["home_rad"].Numbers(n);
    arm.position_gain = OptionalNumbers(arm_map, "position_gain_Nm_per_rad", n, kPositive);
    arm.joint_damping = OptionalNumbers(arm_map, "joint_damping_Nms_per_rad", n, kNotNegative);
    arm.armature = OptionalNumbers(arm_map, "armature_kgm2", n, kNotNegative);
    robot.grippers.push_back(ReadGripper(arm_map["gripper"], arm, model, all));
    const std::set<std::string> bodies = BodiesOf(model, robot.grippers.back());
    if (const YamlValue* lights = arm_map.Find("keep_lights")) arm.keep_lights = lights->Bool();
    if (const YamlValue* stand = arm_map.Find("stand")) ReadStand(*stand, all, &arm);
    if (const YamlValue* excludes = arm_map.Find("excludes")) {
      arm.excludes = ReadExcludes(*excludes, bodies, model.file);
    }
    if (const YamlValue* cameras = arm_map.Find("cameras")) {
      arm.cameras = ReadArmCameras(*cameras, bodies, model.file);
    }
    for (const std::string& body : bodies) all_bodies.insert(arm.prefix() + body);
    robot.arms.push_back(std::move(arm));
  }
  if (robot.arms.empty()) map["arms"].Fail("expected at least one arm");
  if (const YamlValue* cameras = map.Find("cameras")) {
    robot.cameras = ReadRobotCameras(*cameras, all_bodies, robot.file);
  }
  return robot;
}

}  // namespace evalbus
