// Implements World::Reset(), which begins an episode, and its random draws.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <variant>

#include "base/errors.h"
#include "sim/roboeval_start.h"
#include "sim/spawn_grid.h"
#include "sim/world.h"

namespace evalbus::sim {
namespace {

// A spawned object may touch its support. It must not penetrate anything by more than this.
constexpr double kMaxSpawnPenetration = 1e-3;  // m
constexpr int kMaxDraws = 1000;
// Position of distractors that are not in the episode, m: out of reach, out of sight and above the floor.
constexpr std::array<double, 3> kParked = {100, 0, 10};
constexpr double kParkedPitch = 5;

constexpr const char* kAxis[] = {"_x_m", "_y_m", "_z_m"};

}  // namespace

const World::Part& World::MovablePart(const std::string& name) const {
  for (const Part& part : parts_) {
    if (part.name == name && part.is_movable()) return part;
  }
  throw InputError("randomization of '" + name + "': the model has no movable part of this name");
}

std::vector<Parameter> World::Reset(int64_t seed, const Variation& variation, std::string_view seed_stream) {
  action_clips_ = unreachable_poses_ = singular_poses_ = 0;
  instability_.clear();
  forces_.Start();
  for (Arm& arm : arms_) {
    arm.work = 0;
    std::ranges::fill(arm.torque_peak, 0);
  }
  std::vector<Parameter> changes;
  model_ = compiled_;
  if (!variation.physics.empty()) {
    changed_.reset(mj_copyModel(changed_.release(), compiled_));
    changes = RandomizePhysics(variation, seed, changed_.get());
    model_ = changed_.get();
  }
  Random random(seed, 0), distractor_random(seed, kDistractorStream);
  std::vector<Parameter> parameters;
  std::string why;
  for (int i = 0;; ++i) {
    if (i == kMaxDraws) {
      throw InputError(variation.location.ToString() + ": variation '" + variation.name + "': none of " +
                       std::to_string(kMaxDraws) + " draws keeps all parts apart; in the last one, " + why);
    }
    SetHome();
    parameters.clear();
    if (seed_stream == kRoboEvalSeeds) {
      // Like RoboEval, accepts the draw without checking whether the parts penetrate each other.
      PlaceAsRoboEval(seed, variation, &parameters);
      break;
    }
    for (const Randomization& randomization : variation.randomizations) {
      std::visit([&](const auto& spawn) { Spawn(spawn, &random, &parameters); }, randomization);
    }
    parked_dofs_.clear();
    for (const Distractors& distractors : variation.distractors)
      Spawn(distractors, &distractor_random, &parameters);
    if (variation.randomizations.empty() && variation.distractors.empty()) break;
    why = Blocked(variation);
    if (why.empty()) break;
  }
  // The collision checks above have changed mjData. Only the positions are kept.
  const std::vector<double> qpos(data_->qpos, data_->qpos + model_->nq);
  const std::vector<double> mocap_pos(data_->mocap_pos, data_->mocap_pos + 3 * model_->nmocap);
  const std::vector<double> mocap_quat(data_->mocap_quat, data_->mocap_quat + 4 * model_->nmocap);
  SetHome();
  std::copy(qpos.begin(), qpos.end(), data_->qpos);
  std::copy(mocap_pos.begin(), mocap_pos.end(), data_->mocap_pos);
  std::copy(mocap_quat.begin(), mocap_quat.end(), data_->mocap_quat);
  // Initially, the arms' commands equal their positions.
  for (const Arm& arm : arms_) {
    for (size_t j = 0; j < arm.qpos.size(); ++j) data_->ctrl[arm.actuator[j]] = data_->qpos[arm.qpos[j]];
  }
  MakeStartSteps();
  Prepare();
  parameters.insert(parameters.end(), changes.begin(), changes.end());
  return parameters;
}

void World::PlaceAsRoboEval(int64_t seed, const Variation& variation, std::vector<Parameter>* parameters) {
  for (const auto& [object, pose] : DrawRoboEvalStart(variation, seed)) {
    const Part& part = MovablePart(object);
    for (const Randomization& randomization : variation.randomizations) {
      if (const auto* box = std::get_if<SpawnBox>(&randomization); box && box->object == object) {
        Move(part, std::span(pose.position).first(2), parameters);
      } else if (const auto* plane = std::get_if<SpawnPlane>(&randomization);
                 plane && std::ranges::find(plane->objects, object) != plane->objects.end()) {
        Move(part, pose.position, parameters);
      } else if (const auto* yaw = std::get_if<SpawnYaw>(&randomization); yaw && yaw->object == object) {
        Turn(part, pose.yaw, parameters);
      }
    }
  }
}

void World::Move(const Part& part, std::span<const double> position, std::vector<Parameter>* parameters) {
  for (size_t axis = 0; axis < position.size(); ++axis) {
    Position(part)[axis] = position[axis];
    parameters->push_back({part.name + kAxis[axis], position[axis]});
  }
}

void World::Spawn(const SpawnBox& box, Random* random, std::vector<Parameter>* parameters) {
  std::array<double, 2> position{};
  for (size_t axis = 0; axis < 2; ++axis) {
    position[axis] =
        random->Uniform(box.center[axis] - box.half_extents[axis], box.center[axis] + box.half_extents[axis]);
  }
  Move(MovablePart(box.object), position, parameters);
}

void World::Spawn(const SpawnPlane& plane, Random* random, std::vector<Parameter>* parameters) {
  const SpawnGrid grid(plane);
  std::vector<int> points(static_cast<size_t>(grid.size()));
  std::iota(points.begin(), points.end(), 0);
  for (const std::string& object : plane.objects) {
    const auto drawn = points.begin() + random->Index(static_cast<int>(points.size()));
    std::array<double, 3> position = grid.Point(*drawn);
    points.erase(drawn);
    for (size_t axis = 0; axis < 3; ++axis)
      position[axis] += random->Uniform(-plane.jitter[axis], plane.jitter[axis]);
    Move(MovablePart(object), position, parameters);
  }
}

void World::Spawn(const SpawnYaw& spawn, Random* random, std::vector<Parameter>* parameters) {
  Turn(MovablePart(spawn.object), random->Uniform(-spawn.bound, spawn.bound), parameters);
}

void World::Turn(const Part& part, double yaw, std::vector<Parameter>* parameters) {
  const double turn[4] = {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
  mju_mulQuat(Quaternion(part), turn, part.pose.quaternion.data());
  parameters->push_back({part.name + "_yaw_rad", yaw});
}

void World::Spawn(const SpawnJoint& spawn, Random* random, std::vector<Parameter>* parameters) {
  const int joint = mj_name2id(model_, mjOBJ_JOINT, spawn.joint.c_str());
  if (joint < 0)
    throw InputError(spawn.location.ToString() + ": the scene has no joint '" + spawn.joint + "'");
  const double position = random->Uniform(spawn.min, spawn.max);
  data_->qpos[model_->jnt_qposadr[joint]] = position;
  parameters->push_back({spawn.joint + (spawn.is_angle ? "_rad" : "_m"), position});
}

void World::Spawn(const Distractors& distractors, Random* random, std::vector<Parameter>* parameters) {
  std::vector<std::string> left = distractors.objects;
  const int count = distractors.min_count + random->Index(distractors.max_count - distractors.min_count + 1);
  for (int i = 0; i < count; ++i) {
    const auto drawn = left.begin() + random->Index(static_cast<int>(left.size()));
    const Part& part = MovablePart(*drawn);
    left.erase(drawn);
    std::array<double, 2> position{};
    for (size_t axis = 0; axis < 2; ++axis) {
      const double half = distractors.half_extents[axis];
      position[axis] = distractors.center[axis] + random->Uniform(-half, half);
    }
    Move(part, position, parameters);
    Turn(part, random->Uniform(-std::numbers::pi, std::numbers::pi), parameters);
  }
  for (const std::string& object : left) {
    const Part& part = MovablePart(object);
    std::copy(kParked.begin(), kParked.end(), Position(part));
    // Every distractor has its own position.
    Position(part)[1] += kParkedPitch * static_cast<double>(&part - parts_.data());
    for (int dof = 0; dof < model_->nv; ++dof) {
      if (model_->body_rootid[model_->dof_bodyid[dof]] == part.body) parked_dofs_.push_back(dof);
    }
  }
}

bool World::IsMovable(int entity) const {
  return std::ranges::any_of(parts_,
                             [&](const Part& part) { return part.entity == entity && part.is_movable(); });
}

std::string World::Deepest(const mjData& data,
                           const std::function<bool(const mjContact&, int, int)>& counts) const {
  const auto entity = [&](int geom) {
    return info_.body_entity[static_cast<size_t>(model_->geom_bodyid[geom])];
  };
  const mjContact* deepest = nullptr;
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    const int a = entity(contact.geom1), b = entity(contact.geom2);
    if (a == b || contact.dist >= -kMaxSpawnPenetration || !counts(contact, a, b)) continue;
    if (!deepest || contact.dist < deepest->dist) deepest = &contact;
  }
  if (!deepest) return "";
  int a = entity(deepest->geom1), b = entity(deepest->geom2);
  // The message begins with the entity that moves more easily: a free part before a placed part, and a placed
  // part before the robot.
  const auto rank = [&](int which) {
    const auto part = std::ranges::find(parts_, which, &Part::entity);
    const bool is_part = part != parts_.end();
    const bool is_robot = info_.entity_kind[static_cast<size_t>(which)] == model_info_t::ROBOT;
    return is_part && part->qpos >= 0 ? 3 : is_part && part->is_movable() ? 2 : is_robot ? 1 : 0;
  };
  if (rank(a) < rank(b)) std::swap(a, b);
  return fmt::format("{} is {:.3g} mm deep in {}", info_.entity_name[static_cast<size_t>(a)],
                     -deepest->dist * 1000, info_.entity_name[static_cast<size_t>(b)]);
}

std::string World::Overlap() const {
  // MuJoCo ignores contacts between bodies that cannot move. The copy of the model makes it check all pairs
  // of different entities.
  const ModelPtr model(mj_copyModel(nullptr, model_));
  for (int body = 1; body < model->nbody; ++body) {
    if (model->body_weldid[body] == 0) model->body_weldid[body] = model->body_rootid[body];
  }
  const DataPtr data(mj_copyData(nullptr, model_, data_.get()));
  mj_collision(model.get(), data.get());
  const auto is_robot = [&](int entity) {
    return info_.entity_kind[static_cast<size_t>(entity)] == model_info_t::ROBOT;
  };
  return Deepest(*data, [&](const mjContact& contact, int a, int b) {
    if (!is_robot(a) && !is_robot(b)) return CountsForParts(contact, a, b);
    const bool is_in_stand = IsStill(contact.geom1) && IsStill(contact.geom2);
    if (is_in_stand && (MayPenetrate(a) || MayPenetrate(b))) return false;
    // The robot's stand may reach below the floor.
    return (a != 0 || !IsStill(contact.geom2)) && (b != 0 || !IsStill(contact.geom1));
  });
}

bool World::IsStill(int geom) const { return model_->body_weldid[model_->geom_bodyid[geom]] == 0; }

bool World::MayPenetrate(int entity) const {
  const auto part = std::ranges::find(parts_, entity, &Part::entity);
  return part != parts_.end() && part->may_penetrate;
}

bool World::CountsForParts(const mjContact& contact, int a, int b) const {
  if (MayPenetrate(a) || MayPenetrate(b)) return false;
  // A placed part may penetrate a fixed one.
  return IsStill(contact.geom1) && IsStill(contact.geom2) ? IsMovable(a) && IsMovable(b)
                                                          : IsMovable(a) || IsMovable(b);
}

std::string World::Blocked(const Variation& variation) {
  mj_kinematics(model_, data_.get());
  mj_comPos(model_, data_.get());
  mj_collision(spawn_model_.get(), data_.get());
  const std::string overlap =
      Deepest(*data_, [&](const mjContact& contact, int a, int b) { return CountsForParts(contact, a, b); });
  if (!overlap.empty()) return overlap;
  for (const Randomization& randomization : variation.randomizations) {
    const auto* box = std::get_if<SpawnBox>(&randomization);
    if (!box) continue;
    const Part& part = MovablePart(box->object);
    for (const Part& other : parts_) {
      if (!other.is_movable() || &other == &part) continue;
      const double distance = mju_dist3(Position(part), Position(other));
      if (distance < box->min_distance) {
        return fmt::format("{} is {:.3g} m from {}, expected at least {:.6g} m", part.name, distance,
                           other.name, box->min_distance);
      }
    }
  }
  return "";
}

}  // namespace evalbus::sim
