#include "models/model_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "base/errors.h"
#include "lcmtypes/source.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// Range in each direction that MODEL states for an arm's joint without limits.
constexpr double kWholeTurn = 2 * std::numbers::pi;  // rad
// Fraction of a finger joint's range by which an open or closed gripper may be beyond it, because limits are
// soft.
constexpr double kBeyondRange = 0.1;

std::string NameOf(const mjModel& model, mjtObj type, int id) {
  const char* name = mj_id2name(&model, type, id);
  return name ? name : "";
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
    // A body on the world belongs to the entity of the same name or, if there is none, to the world; any
    // other body belongs to the entity of its parent.
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
    info->object_is_tracked.push_back(1);
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

// Lists the geoms of objects that must not be touched. If the task allows specific contacts with an object,
// these are all other geoms of the object.
void FillForbiddenContactGeoms(const TaskDescription& task, model_info_t* info) {
  for (const std::string& object : task.objects) {
    std::vector<std::string> allowed_contacts;
    std::vector<int> geoms;
    std::vector<std::string> geom_names, body_names;
    for (int geom = 0; geom < info->num_geoms; ++geom) {
      if (info->entity_name[info->body_entity[info->geom_body[geom]]] != object) continue;
      geoms.push_back(geom);
      geom_names.push_back(info->geom_name[geom]);
      body_names.push_back(info->body_name[info->geom_body[geom]]);
    }
    std::vector<std::string> known = geom_names;
    known.insert(known.end(), body_names.begin(), body_names.end());
    for (const AllowedContact& part : task.allowed_contacts) {
      if (part.object != object) continue;
      if (std::ranges::find(known, part.name) == known.end()) {
        const std::string in_part = object + "/" + part.name;
        const bool lacks_part = std::ranges::find(known, in_part) != known.end();
        const std::string nearest = lacks_part ? in_part : NearestName(part.name, known);
        throw InputError(part.location.ToString() + ": object '" + object + "' has no body or geom '" +
                         part.name + "' with collision; " +
                         (nearest.empty() ? "expected PART/NAME, a body (" + ListOf(body_names) +
                                                ") or a geom (" + ListOf(geom_names) + ")"
                                          : "did you mean '" + nearest + "'?"));
      }
      allowed_contacts.push_back(part.name);
    }
    for (const int geom : geoms) {
      const auto may_touch = [&](const std::string& name) {
        return std::ranges::find(allowed_contacts, name) != allowed_contacts.end();
      };
      if (!allowed_contacts.empty() && !may_touch(info->geom_name[geom]) &&
          !may_touch(info->body_name[info->geom_body[geom]])) {
        info->forbidden_contact_geom.push_back(geom);
      }
    }
  }
  info->num_forbidden_contact_geoms = static_cast<int>(info->forbidden_contact_geom.size());
}

// Checks that the joint exists and that its initial position fits its type and range.
void CheckJoint(const mjModel& model, const std::string& name, bool is_angle, double position,
                const SourceLocation& where, const model_info_t& info) {
  const auto fail = [&](const std::string& message) {
    throw InputError(where.ToString() + ": joint '" + name + "' " + message);
  };
  const auto found = std::ranges::find(info.joint_name, name);
  if (found == info.joint_name.end()) fail("is not in the scene" + Suggestion(name, info.joint_name));
  const auto joint = found - info.joint_name.begin();
  const int type = model.jnt_type[joint];
  if (type != mjJNT_HINGE && type != mjJNT_SLIDE) fail("is neither a hinge nor a slide joint");
  if ((type == mjJNT_HINGE) != is_angle) {
    fail(is_angle ? "is a slide joint: its position is in m" : "is a hinge: its position is in deg or rad");
  }
  const double lower = model.jnt_range[2 * joint], upper = model.jnt_range[2 * joint + 1];
  if (model.jnt_limited[joint] && (position < lower || position > upper)) {
    const auto degrees = [](double rad) { return rad * 180 / std::numbers::pi; };
    fail(is_angle ? fmt::format("cannot start at {:.6g} degrees ({:.6g} rad): its range is {:.6g} to {:.6g} "
                                "degrees ({:.6g} to {:.6g} rad)",
                                degrees(position), position, degrees(lower), degrees(upper), lower, upper)
                  : fmt::format("cannot start at {:.6g} m: its range is {:.6g} to {:.6g} m", position, lower,
                                upper));
  }
}

void CheckJoints(const TaskDescription& task, const mjModel& model, const model_info_t& info) {
  for (const JointStart& start : task.joints)
    CheckJoint(model, start.joint, start.is_angle, start.position, start.location, info);
  for (const Variation& variation : task.variations) {
    for (const Randomization& randomization : variation.randomizations) {
      const auto* spawn = std::get_if<SpawnJoint>(&randomization);
      if (!spawn) continue;
      // A joint may be missing here, because parts of a variation exist only in the scene of that variation.
      const bool is_here = std::ranges::find(info.joint_name, spawn->joint) != info.joint_name.end();
      if (!is_here && !variation.parts.empty()) continue;
      for (const double position : {spawn->min, spawn->max})
        CheckJoint(model, spawn->joint, spawn->is_angle, position, spawn->location, info);
    }
  }
}

arm_info_t FillArm(const TaskDescription& task, const ArmDescription& arm, const mjModel& model,
                   const model_info_t& info) {
  const std::string prefix = arm.prefix();
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
    const int bias = model.actuator_biastype[actuator];
    if (bias == mjBIAS_NONE ||
        (bias == mjBIAS_AFFINE && model.actuator_biasprm[mjNBIAS * actuator + 1] == 0)) {
      fail("actuator '" + arm.actuators[i] +
           "' is not a position servo, so it would use positions as torques or speeds; give "
           "position_gain_Nm_per_rad");
    }
    const double lower = model.jnt_range[2 * joint], upper = model.jnt_range[2 * joint + 1];
    if (model.jnt_limited[joint] && (arm.home[i] < lower || arm.home[i] > upper)) {
      fail("home position of joint '" + arm.joints[i] + "' is outside its range [" + std::to_string(lower) +
           ", " + std::to_string(upper) + "] rad");
    }
    result.joint_name.push_back(prefix + arm.joints[i]);
    result.joint_qpos_index.push_back(model.jnt_qposadr[joint]);
    result.joint_lower_rad.push_back(model.jnt_limited[joint] ? lower : -kWholeTurn);
    result.joint_upper_rad.push_back(model.jnt_limited[joint] ? upper : kWholeTurn);
    const double* range = model.actuator_forcerange + 2 * actuator;
    result.joint_torque_limit_Nm.push_back(model.actuator_forcelimited[actuator]
                                               ? std::min(std::abs(range[0]), std::abs(range[1])) *
                                                     std::abs(model.actuator_gear[6 * actuator])
                                               : 0);
    const auto start = std::ranges::find(task.joints, result.joint_name.back(), &JointStart::joint);
    result.joint_home_rad.push_back(start == task.joints.end() ? arm.home[i] : start->position);
  }
  result.wrist_site = prefix + arm.wrist_site;
  return result;
}

gripper_info_t FillGripper(const GripperDescription& gripper, int arm, const mjModel& model) {
  const std::string prefix = gripper.prefix();
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
      fail("joint '" + name + "' is neither a slide nor a hinge joint");
    }
    if ((model.jnt_type[joint] == mjJNT_SLIDE) != gripper.is_slide) {
      fail("joint '" + name + "' is a " +
           (gripper.is_slide ? "hinge: its positions are in rad" : "slide joint: its positions are in m"));
    }
    const double lower = model.jnt_range[2 * joint], upper = model.jnt_range[2 * joint + 1];
    for (const auto& [key, position] :
         {std::pair("joint_open", gripper.joint_open), {"joint_closed", gripper.joint_closed}}) {
      const double beyond = std::max(lower - position, position - upper);
      if (!model.jnt_limited[joint] || beyond <= kBeyondRange * (upper - lower)) continue;
      fail(fmt::format("{} of joint '{}' is {:g} {}, expected {:g} to {:g}, its range", key, name, position,
                       gripper.is_slide ? "m" : "rad", lower, upper));
    }
  }
  return result;
}

}  // namespace

model_info_t DescribeModel(const TaskDescription& task, const RobotDescription& robot, const mjModel& model) {
  model_info_t info{};
  info.message_version = model_info_t::VERSION;
  info.task = task.name;
  info.task_yaml = task.text;
  info.task_file = task.file.string();
  info.instruction = task.instruction;
  info.source = source_name::kSim;
  info.has_velocity = info.has_physics = true;
  info.robot = robot.name;
  info.timestep_us = std::llround(model.opt.timestep * 1e6);
  info.time_limit_us = std::llround(task.time_limit * 1e6);
  FillBodies(task, robot, model, &info);
  FillGeomsAndJoints(model, &info);
  FillForbiddenContactGeoms(task, &info);
  CheckJoints(task, model, info);
  for (size_t i = 0; i < robot.arms.size(); ++i) {
    info.arm.push_back(FillArm(task, robot.arms[i], model, info));
    info.gripper.push_back(FillGripper(robot.grippers[i], static_cast<int>(i), model));
  }
  info.num_arms = static_cast<int>(info.arm.size());
  info.num_grippers = static_cast<int>(info.gripper.size());
  return info;
}

bool CompensatesGravity(const mjModel& model) {
  const int number = mj_name2id(&model, mjOBJ_NUMERIC, kGravityCompensation);
  return number < 0 || model.numeric_data[model.numeric_adr[number]] != 0;
}

}  // namespace evalbus
