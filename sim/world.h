// The simulated world: reset from a seed, take joint-position actions, step, report state. Knows neither bus
// nor clock.
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "evalbus/action_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "models/randomized_model.h"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus::sim {

class World {
 public:
  // model: the physics model that BuildScene made of task (as its variation has it) and robot; must outlive
  // the world. substeps: physics steps per control tick. Throws InputError if the model lacks something that
  // the descriptions name.
  World(const mjModel* model, const model_info_t& info, const RobotDescription& robot,
        const TaskDescription& task, int substeps);

  // Robot at home, parts at their poses, then the variation's randomizations in order and its distractors,
  // drawn again as a whole until no movable part penetrates anything and min_distance is kept. Nothing of the
  // episode before survives. Throws InputError if no such draw is found, or for a name that is not there.
  std::vector<Parameter> Reset(int64_t seed, const Variation& variation);

  // What is sunk into what by more than 1 mm, in words ("block is 9.1 mm deep in counter"), of the robot and
  // of what can move with anything, the deepest; empty where nothing is. Of the state that Reset() left.
  std::string Overlap() const;

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
    // J, since Reset.
    double work = 0;
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
  // Robot and parts where they are when nothing is randomized.
  void SetHome();
  void Spawn(const SpawnBox& box, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnPlane& plane, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnYaw& yaw, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnJoint& joint, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const Distractors& distractors, Random* random, std::vector<Parameter>* parameters);
  // Turns a part from its own pose about the vertical.
  void Turn(const Part& part, double yaw, std::vector<Parameter>* parameters);
  // Why the draw will not do: a part penetrates another entity, or two movable parts are nearer than a spawn
  // box allows. Empty: it will.
  std::string Blocked(const Variation& variation);
  bool IsMovable(int entity) const;
  // Of a body that nothing moves.
  bool IsStill(int geom) const;
  // Whether a contact of two entities, neither the robot's, is one that a start must not have.
  bool CountsForParts(const mjContact& contact, int a, int b) const;
  // The deepest contact of two entities that counts, if it is deeper than 1 mm, in words; else empty.
  // `counts` takes two entities.
  std::string Deepest(const mjData& data,
                      const std::function<bool(const mjContact&, int, int)>& counts) const;
  // Everything that follows from positions and velocities, and the compensation of gravity and Coriolis
  // forces on the arms, as the Panda's own controller does it, and on what is parked.
  void Prepare();
  // Of the physics step that was just made: its torques act along the motion with the velocities at its end.
  void AddWork();
  bool IsStable();

  // As compiled, and as this episode has it: another one only where its variation changes masses or friction.
  const mjModel* compiled_;
  ModelPtr changed_;
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
  // Of joints that start elsewhere than in their file, arms' apart.
  struct Start {
    int qpos;
    double position;
  };
  std::vector<Start> starts_;
  // Degrees of freedom of distractors that are not in this episode: they float far away.
  std::vector<int> parked_dofs_;
  int64_t action_clips_ = 0;
  int64_t unreachable_poses_ = 0;
  int64_t singular_poses_ = 0;
  std::string instability_;
};

}  // namespace evalbus::sim
