// The simulated world: reset from a seed, take joint-position actions, step, report state. Knows neither bus
// nor clock.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "base/random.h"
#include "evalbus/action_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus::sim {

// A randomised parameter of an episode; the name ends in its unit ("pot_x_m", "pot_yaw_rad").
struct Parameter {
  std::string name;
  double value = 0;
};

class World {
 public:
  // model: the physics model that BuildScene made of task (as its variation has it) and robot; must outlive
  // the world. substeps: physics steps per control tick. Throws InputError if the model lacks something that
  // the descriptions name.
  World(const mjModel* model, const model_info_t& info, const RobotDescription& robot,
        const TaskDescription& task, int substeps);

  // Robot at home, parts at their poses, then the variation's randomisations in order, drawn again as a whole
  // until no movable part penetrates anything and min_distance is kept. Nothing of the episode before
  // survives. Throws InputError if no such draw is found.
  std::vector<Parameter> Reset(int64_t seed, const Variation& variation);

  // Takes joint targets and gripper commands, clipped to their limits. Returns an empty string, or what is
  // wrong with the action (sizes, mode, NaN); then nothing is taken.
  std::string Apply(const action_t& action);

  // One control tick. False if the physics became unstable: see instability(); only Reset may follow.
  bool Step();
  const std::string& instability() const { return instability_; }

  // Everything except header and deadline_misses. Reuses the storage of state.
  void Fill(state_t* state) const;

  // Control tick [us].
  int64_t tick_us() const { return tick_us_; }

  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

 private:
  struct Arm {
    std::vector<int> qpos, dof, actuator;
    std::vector<double> lower, upper, home;
    int wrist_site = -1;
  };
  struct Gripper {
    std::vector<int> qpos;
    int actuator = -1;
    double joint_open = 0, joint_closed = 0, command_open = 0, command_closed = 0;
  };
  struct Part {
    std::string name;
    int body = -1;
    // Address of the free joint's coordinates; -1 without one.
    int qpos = -1;
    // Index of the mocap body; -1 if it is none.
    int mocap = -1;
    Pose pose;
    // Index of its entity in MODEL.
    int entity = -1;

    bool is_movable() const { return qpos >= 0 || mocap >= 0; }
  };

  const Part& MovablePart(const std::string& name) const;
  // Where a movable part's coordinates are, position and quaternion.
  double* Position(const Part& part) const;
  double* Quaternion(const Part& part) const;
  // Robot and parts where they are when nothing is randomised.
  void SetHome();
  void Spawn(const SpawnBox& box, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnPlane& plane, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnYaw& yaw, Random* random, std::vector<Parameter>* parameters);
  // True if a part penetrates another entity, or two movable parts are nearer than a spawn box allows.
  bool IsBlocked(const Variation& variation);
  // Everything that follows from positions and velocities, and the compensation of gravity and Coriolis
  // forces on the arms, as the Panda's own controller does it.
  void Prepare();
  bool IsStable();

  const mjModel* model_;
  // The same, but placed parts collide with each other, which MuJoCo leaves out for bodies that cannot move.
  ModelPtr spawn_model_;
  const model_info_t info_;
  int substeps_;
  int64_t tick_us_;
  DataPtr data_;
  std::vector<Arm> arms_;
  std::vector<Gripper> grippers_;
  std::vector<Part> parts_;
  int64_t action_clips_ = 0;
  std::string instability_;
};

}  // namespace evalbus::sim
