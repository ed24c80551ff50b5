#include "models/model_consistency.h"

#include <string>
#include <vector>

#include "base/errors.h"

namespace evalbus {
namespace {

void CheckIndices(const std::vector<int32_t>& indices, int limit, const char* what) {
  for (const int32_t index : indices) {
    if (index < 0 || index >= limit) {
      throw InputError("MODEL: " + std::string(what) + " names index " + std::to_string(index) +
                       ", expected 0 to " + std::to_string(limit - 1));
    }
  }
}

}  // namespace

void CheckCoordinates(const model_info_t& info, int num_coordinates) {
  CheckIndices(info.joint_qpos_index, num_coordinates, "joint_qpos_index");
  for (const arm_info_t& arm : info.arm) {
    CheckIndices(arm.joint_qpos_index, num_coordinates, "arm.joint_qpos_index");
  }
}

void CheckConsistency(const model_info_t& info) {
  CheckIndices(info.body_entity, info.num_entities, "body_entity");
  CheckIndices(info.geom_body, info.num_bodies, "geom_body");
  CheckIndices(info.object_entity, info.num_entities, "object_entity");
  CheckIndices(info.forbidden_contact_geom, info.num_geoms, "forbidden_contact_geom");
  // A tick of more than an hour is implausible. Larger times could overflow sums and lose precision in
  // doubles.
  constexpr int64_t kLongestTick_us = 3'600'000'000;
  if (info.timestep_us < 1 || info.substeps < 1 || info.timestep_us > kLongestTick_us / info.substeps) {
    throw InputError("MODEL: a tick is " + std::to_string(info.substeps) + " steps of " +
                     std::to_string(info.timestep_us) + " us, expected more than 0 and less than an hour");
  }
  constexpr int kMany = 1 << 20;
  CheckCoordinates(info, kMany);
  for (const arm_info_t& arm : info.arm) {
    for (int i = 0; i < arm.num_joints; ++i) {
      if (arm.joint_lower_rad[i] <= arm.joint_upper_rad[i]) continue;
      throw InputError("MODEL: arm '" + arm.name + "': the range of joint " + std::to_string(i) + " is none");
    }
  }
  for (const gripper_info_t& gripper : info.gripper) {
    CheckIndices({gripper.arm}, info.num_arms, "gripper.arm");
    CheckIndices(gripper.pad_geom, info.num_geoms, "gripper.pad_geom");
  }
}

}  // namespace evalbus
