// A synthetic model with its messages, for task evaluation and scoring without MuJoCo. It has two one-joint
// arms, a counter and a pot.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "evalbus/contacts_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/unit/set_array.h"

namespace evalbus::small_world {

// Ids of bodies and geoms in the model.
enum Body { kWorld, kLeftBase, kLeftHand, kRightBase, kRightHand, kCounter, kPot, kLid, kNumBodies };
enum Geom { kFloor, kLeftLink, kLeftPad, kRightLink, kRightPad, kTop, kWall, kLidGeom, kNumGeoms };

inline constexpr char kTask[] = R"(name: small
title: Lift a pot
robot: {file: robot.yaml}
time_limit_s: 5
scene:
  base: scene.xml
  parts:
    - name: counter
      model: counter.xml
      pose: {position_m: [0.7, 0, 0]}
    - name: pot
      model: pot.xml
      pose: {position_m: [0.7, 0, 1]}
      free: true
objects: [pot]
variations: {base: {}}
metrics: {slip_sample_window_ticks: 1}
stages:
  - name: held
    when: {holding: {gripper: any, object: pot}}
  - name: lifted
    when: {height_above: {object: pot, min_m: 1.1}}
success:
  all:
    - not: {touching: {a: pot, b: counter}}
    - height_above: {object: pot, min_m: 1.1}
failure: {touching: {a: pot, b: world}}
target_distance:
  lift: {lift: {object: pot}}
  left_gripper_to_pot: {distance: {a: left, b: pot}}
pose_error: {tilt: {object: pot, axis: y}}
)";

inline model_info_t Model() {
  model_info_t model{};
  model.message_version = model_info_t::VERSION;
  model.task = "small";
  model.variation = "base";
  model.task_yaml = kTask;
  model.task_file = "small.yaml";
  model.timestep_us = 2000;
  model.substeps = 10;
  model.entity_name = {"world", "left", "right", "counter", "pot"};
  model.entity_kind = {model_info_t::WORLD, model_info_t::ROBOT, model_info_t::ROBOT, model_info_t::FIXTURE,
                       model_info_t::OBJECT};
  model.num_entities = 5;
  model.body_name = {"world",      "left/base",       "left/hand", "right/base",
                     "right/hand", "counter/counter", "pot/pot",   "pot/lid"};
  model.body_entity = {0, 1, 1, 2, 2, 3, 4, 4};
  model.num_bodies = kNumBodies;
  model.geom_name = {"floor",     "left/link",   "left/pad", "right/link",
                     "right/pad", "counter/top", "pot/wall", ""};
  model.geom_body = {kWorld, kLeftBase, kLeftHand, kRightBase, kRightHand, kCounter, kPot, kLid};
  model.num_geoms = kNumGeoms;
  for (const char* name : {"left", "right"}) {
    arm_info_t arm{};
    arm.name = name;
    arm.entity = model.num_arms + 1;
    arm.num_joints = 1;
    arm.joint_name = {std::string(name) + "/joint"};
    arm.joint_qpos_index = {model.num_arms};
    arm.joint_lower_rad = {-3};
    arm.joint_upper_rad = {3};
    arm.joint_torque_limit_Nm = {87};
    arm.joint_home_rad = {0};
    gripper_info_t gripper{};
    gripper.name = name;
    gripper.arm = model.num_arms;
    gripper.num_pad_geoms = 1;
    gripper.pad_geom = {model.num_arms == 0 ? kLeftPad : kRightPad};
    model.arm.push_back(arm);
    model.gripper.push_back(gripper);
    ++model.num_arms;
    ++model.num_grippers;
  }
  model.object_name = {"pot"};
  model.object_entity = {4};
  model.object_is_tracked = {1};
  model.num_objects = 1;
  model.has_velocity = model.has_physics = 1;
  return model;
}

// Some tests use ticks whose time does not fit into a message. Their time is limited to 20,000,000 s.
inline header_t Header(int64_t tick, int32_t episode = 0) {
  header_t header{};
  header.episode = episode;
  header.tick = tick;
  header.sim_time_us = std::clamp<int64_t>(tick, -1'000'000'000, 1'000'000'000) * 20000;
  return header;
}

// Everything is upright and at rest, and the pot is on the counter.
inline state_t State(int64_t tick, int32_t episode = 0) {
  state_t state{};
  state.header = Header(tick, episode);
  state.num_bodies = kNumBodies;
  state.body.assign(kNumBodies, {{0, 0, 0}, {1, 0, 0, 0}});
  Set(&state.body[kPot].position_m, {0.7, 0, 1});
  for (int k = 0; k < 2; ++k) {
    arm_state_t arm{};
    arm.num_joints = 1;
    arm.joint_position_rad = {0};
    arm.joint_velocity_radps = {0};
    arm.joint_torque_Nm = arm.joint_torque_peak_Nm = arm.joint_command_rad = {0};
    arm.wrist_position_m[0] = 0.7;
    arm.wrist_position_m[2] = 1.5;
    arm.wrist_quat_wxyz[0] = 1;
    state.arm.push_back(arm);
    gripper_state_t gripper{};
    gripper.opening = 0.5;
    state.gripper.push_back(gripper);
  }
  state.num_arms = state.num_grippers = 2;
  return state;
}

inline contacts_t Contacts(int64_t tick, const std::vector<std::pair<int, int>>& pairs = {{kTop, kWall}},
                           int32_t episode = 0) {
  contacts_t contacts{};
  contacts.header = Header(tick, episode);
  for (const auto& [a, b] : pairs) {
    contact_t contact{};
    contact.geom_a = a;
    contact.geom_b = b;
    contact.distance_m = -0.001;
    contacts.contact.push_back(contact);
  }
  contacts.num_contacts = contacts.contact.size();
  return contacts;
}

}  // namespace evalbus::small_world
