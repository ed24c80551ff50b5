#include "models/scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <vector>

#include "base/errors.h"
#include "models/compile_model.h"
#include "models/mjcf_xml.h"
#include "models/model_info.h"
#include "models/scene_composer.h"
#include "models/texture_files.h"
#include "models/vibration.h"

namespace evalbus {
namespace {

// Returns the pose of B in W, given the pose of A in W and the pose of B in A.
Pose Compose(const Pose& a, const Pose& b) {
  Pose result;
  double turned[3];
  mju_rotVecQuat(turned, b.position.data(), a.quaternion.data());
  for (int i = 0; i < 3; ++i) result.position[i] = a.position[i] + turned[i];
  mju_mulQuat(result.quaternion.data(), a.quaternion.data(), b.quaternion.data());
  return result;
}

void AttachArm(const ArmDescription& arm, const GripperDescription& gripper, const Pose& robot_base,
               SceneComposer* composer) {
  const std::string prefix = arm.prefix();
  std::map<std::string, double> arm_stiffness, gripper_stiffness;
  for (size_t j = 0; j < arm.position_gain.size(); ++j)
    arm_stiffness[arm.actuators[j]] = arm.position_gain[j];
  if (gripper.position_gain > 0) {
    (gripper.model_file.empty() ? arm_stiffness : gripper_stiffness)[gripper.actuator] =
        gripper.position_gain;
  }
  composer->Attach(arm.model_file, prefix, Compose(robot_base, arm.base),
                   {.stiffness = arm_stiffness, .keep_lights = arm.keep_lights});
  if (!gripper.model_file.empty()) {
    composer->Attach(gripper.model_file, gripper.prefix(), gripper.mount,
                     {.parent_body = prefix + gripper.attach_body, .stiffness = gripper_stiffness});
  }
  if (!arm.stand_file.empty()) {
    composer->Attach(arm.stand_file, prefix + "stand/", arm.stand_pose, {.parent_body = arm.name});
  }
  for (size_t j = 0; j < arm.joints.size(); ++j) {
    if (!arm.joint_damping.empty()) {
      composer->SetJointAttribute(prefix + arm.joints[j], "damping", arm.joint_damping[j]);
    }
    if (!arm.armature.empty())
      composer->SetJointAttribute(prefix + arm.joints[j], "armature", arm.armature[j]);
  }
  if (gripper.joint_damping >= 0) {
    for (const std::string& joint : gripper.joints) {
      composer->SetJointAttribute(gripper.prefix() + joint, "damping", gripper.joint_damping);
    }
  }
  for (const auto& [body, other] : arm.excludes) composer->Exclude(prefix + body, prefix + other);
  for (const CameraDescription& camera : arm.cameras) {
    composer->SetCamera(prefix + camera.name, camera.pose, camera.vertical_fov, prefix + camera.body);
  }
}

// Returns the pose of a camera. MuJoCo's cameras look along -z, with x to the right and y up.
Pose PoseOf(const Camera& camera) {
  double back[3], right[3], up[3];
  mju_sub3(back, camera.position.data(), camera.look_at.data());
  mju_normalize3(back);
  const double vertical[3] = {0, 0, 1};
  mju_cross(right, vertical, back);
  mju_normalize3(right);
  mju_cross(up, back, right);
  const double axes[9] = {right[0], up[0], back[0], right[1], up[1], back[1], right[2], up[2], back[2]};
  Pose pose{.position = camera.position, .quaternion = {}};
  mju_mat2Quat(pose.quaternion.data(), axes);
  return pose;
}

bool InertiasAgree(const mjModel& a, const mjModel& b) {
  return std::memcmp(a.body_mass, b.body_mass, a.nbody * sizeof(mjtNum)) == 0 &&
         std::memcmp(a.body_inertia, b.body_inertia, 3 * a.nbody * sizeof(mjtNum)) == 0 &&
         std::memcmp(a.body_ipos, b.body_ipos, 3 * a.nbody * sizeof(mjtNum)) == 0 &&
         std::memcmp(a.body_iquat, b.body_iquat, 4 * a.nbody * sizeof(mjtNum)) == 0;
}

// Returns the model with corrected masses of meshes if the masses that MuJoCo has inferred are wrong;
// otherwise null.
ModelPtr WithMeshMasses(const mjModel& model, SceneComposer* composer) {
  std::vector<std::string> warnings;
  if (!composer->SetMeshMasses(model)) return nullptr;
  ModelPtr corrected = CompileModel(*composer, false, &warnings);
  composer->RemoveMeshMasses();
  for (int body = 0; body < model.nbody; ++body) {
    const double mass = model.body_mass[body], difference = corrected->body_mass[body] - mass;
    if (std::abs(difference) > 1e-6 * mass) return corrected;
  }
  return nullptr;
}

// Checks that the two models agree in everything on which ids in messages and replayed states depend.
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

// Throws InputError unless the timestep is a whole number of microseconds, because messages count simulated
// time in microseconds.
void CheckTimestep(double timestep, const SceneComposer& composer) {
  const double us = std::round(timestep * 1e6);
  // The comparison is exact, because both sides are the double nearest to the number in the file.
  if (us >= 1 && us <= 1e6 && us / 1e6 == timestep) return;
  throw InputError(
      composer.OptionSource() +
      ": <option>: attribute 'timestep': expected a whole number of microseconds from 1 us to 1 s, "
      "got " +
      mjcf::NumberText(timestep) + " s");
}

}  // namespace

Scene BuildScene(const TaskDescription& task, const RobotDescription& robot) {
  SceneComposer composer(task.scene_file);
  for (size_t i = 0; i < robot.arms.size(); ++i) {
    AttachArm(robot.arms[i], robot.grippers[i], task.robot_base, &composer);
  }
  if (!robot.gravity_compensation) composer.SetNumber(kGravityCompensation, 0);
  for (const CameraDescription& camera : robot.cameras) {
    const Pose pose = camera.body.empty() ? Compose(task.robot_base, camera.pose) : camera.pose;
    composer.SetCamera(camera.name, pose, camera.vertical_fov, camera.body);
  }
  for (const ScenePart& part : task.parts) {
    for (const ArmDescription& arm : robot.arms) {
      if (part.name == arm.name) {
        throw InputError(part.location.ToString() + ": part '" + part.name + "' has the name of an arm of " +
                         robot.name);
      }
    }
    const Mount mount = part.free ? Mount::kFree : part.placed ? Mount::kMocap : Mount::kFixed;
    composer.Attach(part.model_file, part.name + "/", part.pose, {.mount = mount, .without = part.without});
    for (const PartSite& site : part.sites) {
      try {
        composer.AddSite(part.name + "/" + site.name, site.pose, part.name);
      } catch (const InputError& error) {
        throw InputError(part.location.ToString() + ": " + error.what());
      }
    }
  }

  // If names repeat, the first camera takes precedence, so cameras are set in reverse order. A variation's
  // cameras precede the cameras of the task.
  const std::vector<Camera> last_first(task.cameras.rbegin(), task.cameras.rend());
  for (const Camera& camera : last_first)
    composer.SetCamera(camera.name, PoseOf(camera), camera.vertical_fov);

  for (const NameInFile& texture : task.textures) {
    if (texture.text == kPlain || composer.KeepTexture(texture.text)) continue;
    composer.AddTexture(texture.text, TextureFile(texture, task.file.parent_path()),
                        texture.location.ToString());
  }

  Scene scene;
  scene.warnings = composer.warnings();
  scene.visual = CompileModel(composer, false, &scene.warnings);
  ModelPtr corrected = WithMeshMasses(*scene.visual, &composer);
  try {
    if (!corrected) scene.physics = CompileModel(composer, true, &scene.warnings);
  } catch (const InputError&) {
    // Compilation fails here if all mass is in visual geoms, which the second attempt below corrects. Any
    // other error is reported by the second attempt.
  }
  if (corrected) scene.visual = std::move(corrected);
  if (!scene.physics || !InertiasAgree(*scene.physics, *scene.visual)) {
    // Inertias are taken from the visual model, because with discardvisual MuJoCo drops visual geoms before
    // it infers inertias.
    composer.SetInertials(*scene.visual);
    scene.physics = CompileModel(composer, true, &scene.warnings);
    // When MuJoCo reads an <inertial>, its numbers may change in their last bits. Both models must then be
    // compiled from it.
    if (!InertiasAgree(*scene.physics, *scene.visual))
      scene.visual = CompileModel(composer, false, &scene.warnings);
  }
  CheckTimestep(scene.physics->opt.timestep, composer);
  scene.xml = composer.ToXml();
  CheckAgreement(*scene.physics, *scene.visual);
  // Two arms with the same model produce every warning twice.
  std::vector<std::string> unique;
  for (const std::string& warning : scene.warnings) {
    if (std::find(unique.begin(), unique.end(), warning) == unique.end()) unique.push_back(warning);
  }
  scene.warnings = unique;

  scene.info = DescribeModel(task, robot, *scene.physics);
  for (const std::string& warning : FindVibration(robot, scene.info, *scene.physics)) {
    scene.warnings.push_back(warning);
  }
  return scene;
}

}  // namespace evalbus
