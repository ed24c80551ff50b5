#include "models/scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <regex>

#include "base/errors.h"

namespace evalbus {
namespace {

// MuJoCo reports through two global function pointers; without them mju_error waits for a key. While one of
// these exists, warnings go into its list and errors are thrown.
class CompileGuard {
 public:
  explicit CompileGuard(std::vector<std::string>* warnings)
      : lock_(mutex_), error_(mju_user_error), warning_(mju_user_warning) {
    warnings_of_ = warnings;
    mju_user_error = [](const char* message) { throw InputError(std::string("MuJoCo: ") + message); };
    mju_user_warning = [](const char* message) {
      warnings_of_->push_back(std::string("MuJoCo: ") + message);
    };
  }
  ~CompileGuard() {
    mju_user_error = error_;
    mju_user_warning = warning_;
  }
  CompileGuard(const CompileGuard&) = delete;
  CompileGuard& operator=(const CompileGuard&) = delete;

 private:
  static inline std::mutex mutex_;
  static inline std::vector<std::string>* warnings_of_ = nullptr;
  std::lock_guard<std::mutex> lock_;
  void (*error_)(const char*);
  void (*warning_)(const char*);
};

struct VfsDeleter {
  void operator()(mjVFS* vfs) const {
    mj_deleteVFS(vfs);
    delete vfs;
  }
};

// MuJoCo's message in one line, with our file and line in place of those of the composed document.
std::string Translate(std::string message, const SceneComposer& composer) {
  std::string source;
  std::smatch match;
  if (std::regex_search(message, match, std::regex(R"(line =? ?(\d+))")))
    source = composer.Locate(std::stoi(match[1]));
  // "Object name = pot/pot, id = 3, line = 40, column = -1", "Element 'geom', line 40"
  message = std::regex_replace(message, std::regex(R"(\s*Object name = (\S*), id = (-?\d+).*)"), " ('$1')");
  message = std::regex_replace(message, std::regex(R"(\s*Element '(\w+)', line.*)"), " (<$1>)");
  message = std::regex_replace(message, std::regex(R"(^(XML )?Error: )"), "");
  message = std::regex_replace(message, std::regex(R"(( in object '' \(id = \d+\))?( \(''\))?$)"), "");
  message = std::regex_replace(message, std::regex(R"(('[^']+')(.*) \(\1\)$)"), "$1$2");
  message = std::regex_replace(message, std::regex(R"(\s+)"), " ");
  while (!message.empty() && message.back() == ' ') message.pop_back();
  return (source.empty() ? "scene" : source) + ": MuJoCo: " + message;
}

std::string NameOf(const mjModel& model, mjtObj type, int id) {
  const char* name = mj_id2name(&model, type, id);
  return name ? name : "";
}

// Pose of B in W from A in W and B in A.
Pose Compose(const Pose& a, const Pose& b) {
  Pose result;
  double turned[3];
  mju_rotVecQuat(turned, b.position.data(), a.quaternion.data());
  for (int i = 0; i < 3; ++i) result.position[i] = a.position[i] + turned[i];
  mju_mulQuat(result.quaternion.data(), a.quaternion.data(), b.quaternion.data());
  return result;
}

std::string HandPrefix(const GripperDescription& gripper) {
  return gripper.model_file.empty() ? gripper.arm + "/" : gripper.arm + "/hand/";
}

void AttachRobot(const TaskDescription& task, const RobotDescription& robot, SceneComposer* composer) {
  for (size_t i = 0; i < robot.arms.size(); ++i) {
    const ArmDescription& arm = robot.arms[i];
    const GripperDescription& gripper = robot.grippers[i];
    const std::string prefix = arm.name + "/";
    composer->Attach(arm.model_file, prefix, Compose(task.robot_base, arm.base));
    if (!gripper.model_file.empty()) {
      composer->Attach(gripper.model_file, HandPrefix(gripper), gripper.mount, Mount::kFixed,
                       prefix + gripper.attach_body);
    }
    for (size_t j = 0; j < arm.joints.size(); ++j) {
      if (!arm.position_gain.empty())
        composer->SetPositionGain(prefix + arm.actuators[j], arm.position_gain[j]);
      if (!arm.joint_damping.empty()) {
        composer->SetJointAttribute(prefix + arm.joints[j], "damping", arm.joint_damping[j]);
      }
      if (!arm.armature.empty())
        composer->SetJointAttribute(prefix + arm.joints[j], "armature", arm.armature[j]);
    }
    if (gripper.joint_damping >= 0) {
      for (const std::string& joint : gripper.joints) {
        composer->SetJointAttribute(HandPrefix(gripper) + joint, "damping", gripper.joint_damping);
      }
    }
  }
}

bool InertiasAgree(const mjModel& a, const mjModel& b) {
  return std::memcmp(a.body_mass, b.body_mass, a.nbody * sizeof(mjtNum)) == 0 &&
         std::memcmp(a.body_inertia, b.body_inertia, 3 * a.nbody * sizeof(mjtNum)) == 0 &&
         std::memcmp(a.body_ipos, b.body_ipos, 3 * a.nbody * sizeof(mjtNum)) == 0;
}

// The two models must agree in everything that ids in messages and replayed states rely on.
void CheckAgreement(const mjModel& physics, const mjModel& visual) {
  const auto colliding = [](const mjModel& model) {
    int count = 0;
    for (int i = 0; i < model.ngeom; ++i) count += (model.geom_contype[i] | model.geom_conaffinity[i]) != 0;
    return count;
  };
  if (physics.nbody != visual.nbody || physics.njnt != visual.njnt || physics.nq != visual.nq ||
      physics.nv != visual.nv || physics.nmocap != visual.nmocap || physics.nu != visual.nu ||
      physics.nsite != visual.nsite || physics.ntendon != visual.ntendon || physics.neq != visual.neq ||
      colliding(physics) != colliding(visual) || !InertiasAgree(physics, visual)) {
    throw InputError("scene: MuJoCo's discardvisual drops more than visual geoms");
  }
}

void FillBodies(const TaskDescription& task, const RobotDescription& robot, const mjModel& model,
                model_info_t* info) {
  info->entity_name = {"world"};
  info->entity_kind = {model_info_t::WORLD};
  std::map<std::string, int> entity_of;
  const auto add_entity = [&](const std::string& name, int8_t kind) {
    entity_of[name] = static_cast<int>(info->entity_name.size());
    info->entity_name.push_back(name);
    info->entity_kind.push_back(kind);
  };
  for (const ArmDescription& arm : robot.arms) add_entity(arm.name, model_info_t::ROBOT);
  for (const ScenePart& part : task.parts) {
    const bool is_object =
        std::find(task.objects.begin(), task.objects.end(), part.name) != task.objects.end();
    add_entity(part.name, is_object ? model_info_t::OBJECT : model_info_t::FIXTURE);
  }
  info->num_entities = static_cast<int>(info->entity_name.size());

  info->num_bodies = model.nbody;
  for (int i = 0; i < model.nbody; ++i) {
    info->body_name.push_back(NameOf(model, mjOBJ_BODY, i));
    // What stands on the world belongs to the entity of its name; the rest to its parent's.
    const int parent = model.body_parentid[i];
    const auto entity = entity_of.find(info->body_name[i]);
    if (i == 0) {
      info->body_entity.push_back(0);
    } else if (parent == 0) {
      info->body_entity.push_back(entity == entity_of.end() ? 0 : entity->second);
    } else {
      info->body_entity.push_back(info->body_entity[parent]);
    }
  }
  for (const std::string& object : task.objects) {
    info->object_name.push_back(object);
    info->object_entity.push_back(entity_of.at(object));
  }
  info->num_objects = static_cast<int>(task.objects.size());
}

void FillGeomsAndJoints(const mjModel& model, model_info_t* info) {
  info->num_geoms = model.ngeom;
  for (int i = 0; i < model.ngeom; ++i) {
    const int body = model.geom_bodyid[i];
    std::string name = NameOf(model, mjOBJ_GEOM, i);
    if (name.empty()) name = info->body_name[body] + "/geom" + std::to_string(i - model.body_geomadr[body]);
    info->geom_name.push_back(name);
    info->geom_body.push_back(body);
  }
  info->num_joints = model.njnt;
  for (int i = 0; i < model.njnt; ++i) {
    const int body = model.jnt_bodyid[i];
    std::string name = NameOf(model, mjOBJ_JOINT, i);
    if (name.empty()) name = info->body_name[body] + "/joint" + std::to_string(i - model.body_jntadr[body]);
    info->joint_name.push_back(name);
    info->joint_qpos_index.push_back(model.jnt_qposadr[i]);
    const bool limited =
        model.jnt_limited[i] && model.jnt_type[i] != mjJNT_FREE && model.jnt_type[i] != mjJNT_BALL;
    info->joint_lower_mixed.push_back(limited ? model.jnt_range[2 * i] : 0);
    info->joint_upper_mixed.push_back(limited ? model.jnt_range[2 * i + 1] : 0);
  }
}

arm_info_t FillArm(const ArmDescription& arm, const mjModel& model, const model_info_t& info) {
  const std::string prefix = arm.name + "/";
  const auto fail = [&](const std::string& message) {
    throw InputError(arm.location.ToString() + ": arm '" + arm.name + "': " + message);
  };
  arm_info_t result{};
  result.name = arm.name;
  result.entity = info.body_entity[mj_name2id(&model, mjOBJ_BODY, arm.name.c_str())];
  result.num_joints = static_cast<int>(arm.joints.size());
  for (size_t i = 0; i < arm.joints.size(); ++i) {
    const int joint = mj_name2id(&model, mjOBJ_JOINT, (prefix + arm.joints[i]).c_str());
    const int actuator = mj_name2id(&model, mjOBJ_ACTUATOR, (prefix + arm.actuators[i]).c_str());
    if (model.jnt_type[joint] != mjJNT_HINGE) fail("joint '" + arm.joints[i] + "' is not a hinge");
    if (model.actuator_trntype[actuator] != mjTRN_JOINT || model.actuator_trnid[2 * actuator] != joint) {
      fail("actuator '" + arm.actuators[i] + "' does not drive joint '" + arm.joints[i] + "'");
    }
    const double lower = model.jnt_range[2 * joint], upper = model.jnt_range[2 * joint + 1];
    if (model.jnt_limited[joint] && (arm.home[i] < lower || arm.home[i] > upper)) {
      fail("home position of joint '" + arm.joints[i] + "' is outside its range [" + std::to_string(lower) +
           ", " + std::to_string(upper) + "] rad");
    }
    result.joint_name.push_back(prefix + arm.joints[i]);
    result.joint_qpos_index.push_back(model.jnt_qposadr[joint]);
    result.joint_lower_rad.push_back(model.jnt_limited[joint] ? lower : 0);
    result.joint_upper_rad.push_back(model.jnt_limited[joint] ? upper : 0);
    result.joint_home_rad.push_back(arm.home[i]);
  }
  result.wrist_site = prefix + arm.wrist_site;
  return result;
}

gripper_info_t FillGripper(const GripperDescription& gripper, int arm, const mjModel& model) {
  const std::string prefix = HandPrefix(gripper);
  const auto fail = [&](const std::string& message) {
    throw InputError(gripper.location.ToString() + ": gripper of arm '" + gripper.arm + "': " + message);
  };
  gripper_info_t result{};
  result.name = gripper.arm;
  result.arm = arm;
  for (const std::string& name : gripper.pad_bodies) {
    const int body = mj_name2id(&model, mjOBJ_BODY, (prefix + name).c_str());
    const size_t before = result.pad_geom.size();
    for (int i = 0; i < model.body_geomnum[body]; ++i) {
      const int geom = model.body_geomadr[body] + i;
      if (model.geom_contype[geom] | model.geom_conaffinity[geom]) result.pad_geom.push_back(geom);
    }
    if (result.pad_geom.size() == before) fail("pad body '" + name + "' has no geom that collides");
  }
  result.num_pad_geoms = static_cast<int>(result.pad_geom.size());
  for (const std::string& name : gripper.joints) {
    const int joint = mj_name2id(&model, mjOBJ_JOINT, (prefix + name).c_str());
    if (model.jnt_type[joint] != mjJNT_HINGE && model.jnt_type[joint] != mjJNT_SLIDE) {
      fail("joint '" + name + "' neither slides nor hinges");
    }
  }
  return result;
}

}  // namespace

ModelPtr CompileModel(const SceneComposer& composer, bool discard_visual,
                      std::vector<std::string>* warnings) {
  constexpr const char* kFile = "scene.xml";
  const std::string xml = composer.ToXml(discard_visual);
  auto* raw_vfs = new mjVFS;
  mj_defaultVFS(raw_vfs);
  const std::unique_ptr<mjVFS, VfsDeleter> vfs(raw_vfs);
  mj_makeEmptyFileVFS(vfs.get(), kFile, static_cast<int>(xml.size()));
  xml.copy(static_cast<char*>(vfs->filedata[mj_findFileVFS(vfs.get(), kFile)]), xml.size());

  const CompileGuard guard(warnings);
  char message[2000] = "";
  ModelPtr model(mj_loadXML(kFile, vfs.get(), message, sizeof(message)));
  if (!model) throw InputError(Translate(message, composer));
  if (*message) warnings->push_back(Translate(message, composer));
  return model;
}

Scene BuildScene(const TaskDescription& task, const RobotDescription& robot) {
  SceneComposer composer(task.scene_file);
  AttachRobot(task, robot, &composer);
  for (const ScenePart& part : task.parts) {
    for (const ArmDescription& arm : robot.arms) {
      if (part.name == arm.name) {
        throw InputError(part.location.ToString() + ": part '" + part.name + "' has the name of an arm of " +
                         robot.name);
      }
    }
    const Mount mount = part.free ? Mount::kFree : part.placed ? Mount::kMocap : Mount::kFixed;
    composer.Attach(part.model_file, part.name + "/", part.pose, mount);
  }

  Scene scene;
  scene.warnings = composer.warnings();
  scene.visual = CompileModel(composer, false, &scene.warnings);
  scene.physics = CompileModel(composer, true, &scene.warnings);
  if (!InertiasAgree(*scene.physics, *scene.visual)) {
    // MuJoCo drops visual geoms before it infers inertias from geoms.
    composer.SetInertials(*scene.visual);
    scene.visual = CompileModel(composer, false, &scene.warnings);
    scene.physics = CompileModel(composer, true, &scene.warnings);
  }
  scene.xml = composer.ToXml();
  CheckAgreement(*scene.physics, *scene.visual);
  // Two arms of one model say everything twice.
  std::vector<std::string> unique;
  for (const std::string& warning : scene.warnings) {
    if (std::find(unique.begin(), unique.end(), warning) == unique.end()) unique.push_back(warning);
  }
  scene.warnings = unique;

  const mjModel& model = *scene.physics;
  model_info_t& info = scene.info;
  info.message_version = model_info_t::VERSION;
  info.task = task.name;
  info.task_yaml = task.text;
  info.task_file = task.file.string();
  info.robot = robot.name;
  info.timestep_us = std::llround(model.opt.timestep * 1e6);
  info.time_limit_us = std::llround(task.time_limit * 1e6);
  FillBodies(task, robot, model, &info);
  FillGeomsAndJoints(model, &info);
  for (size_t i = 0; i < robot.arms.size(); ++i) {
    info.arm.push_back(FillArm(robot.arms[i], model, info));
    info.gripper.push_back(FillGripper(robot.grippers[i], static_cast<int>(i), model));
  }
  info.num_arms = static_cast<int>(info.arm.size());
  info.num_grippers = static_cast<int>(info.gripper.size());
  return scene;
}

}  // namespace evalbus
