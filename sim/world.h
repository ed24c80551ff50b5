// The simulated world. It is reset from a seed, applies joint-position actions, simulates steps and reports
// its state. It uses no bus and no clock.
#pragma once

#include <mujoco/mujoco.h>

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "evalbus/action_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "models/randomized_model.h"
#include "models/robot_description.h"
#include "models/task_description.h"
#include "sim/contact_points.h"
#include "sim/force_sums.h"

namespace evalbus::sim {

class World {
 public:
  // model: physics model that BuildScene made of `task` (with its variation applied) and `robot`; must
  // outlive the world. substeps: physics steps per control tick. Throws InputError if the model lacks a name
  // in the descriptions.
  World(const mjModel* model, const model_info_t& info, const RobotDescription& robot,
        const TaskDescription& task, int substeps);

  // Changes masses and friction as the variation requires, moves the robot to its home and the parts to their
  // poses, and applies the variation's randomizations, in order, and its distractors. If there are any, they
  // are drawn again until no movable part penetrates anything by more than 1 mm (except as in Overlap()) and
  // min_distance is satisfied. Nothing of the previous episode remains. Returns the drawn parameters. Throws
  // InputError if no valid draw is found or a name does not exist. With seed_stream kRoboEvalSeeds, the parts
  // start where RoboEval places them, without these checks.
  std::vector<Parameter> Reset(int64_t seed, const Variation& variation,
                               std::string_view seed_stream = kRunSeeds);

  // Returns a description of the deepest penetration of more than 1 mm after Reset() ("block is 9.1 mm deep
  // in counter"). Checks the robot and all movable parts against everything, with three exceptions: parts
  // with may_penetrate (unless a moving link is in one), the robot's stand in the world, and placed parts in
  // fixed ones. Empty if there is none.
  std::string Overlap() const;

  // Sets joint targets and gripper commands, clipped to their limits. If the action is invalid (sizes, mode,
  // NaN), changes nothing and returns a description of the error; otherwise returns an empty string.
  std::string Apply(const action_t& action);

  // Simulates one control tick. Returns false if the physics became unstable (see instability()); after that,
  // only Reset() may be called.
  bool Step();
  const std::string& instability() const { return instability_; }

  // The state of the simulation, for Restore() within the same episode. After Restore(), equal actions lead
  // to bit-identical states.
  struct Snapshot {
    std::vector<double> qpos, qvel, act, ctrl, warm_start, mocap_pos, mocap_quat, work;
    ForceSums forces;
    double time = 0;
    int64_t action_clips = 0, unreachable_poses = 0, singular_poses = 0;
  };
  Snapshot Save() const;
  void Restore(const Snapshot& snapshot);

  // Fills everything except header and deadline_misses. Reuses the storage of `state`.
  void Fill(state_t* state) const;

  // Returns the duration of a control tick, us.
  int64_t tick_us() const { return tick_us_; }

  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

 private:
  struct Arm {
    std::vector<int> qpos, dof, actuator;
    std::vector<double> lower, upper, home;
    int wrist_site = -1;
    // Work since Reset(), J.
    double work = 0;
    // Largest absolute torque of each joint in the physics steps of the current control tick, N m.
    std::vector<double> torque_peak;
  };
  struct Gripper {
    std::vector<int> qpos;
    int actuator = -1;
    double joint_open = 0, joint_closed = 0, command_open = 0, command_closed = 0;
    double start_opening = 1;
    bool binary_command = false;
  };
  struct Part {
    std::string name;
    int body = -1;
    // Address of the free joint's coordinates; -1 without a free joint.
    int qpos = -1;
    // Index of the mocap body; -1 if the part is not one.
    int mocap = -1;
    Pose pose;
    // Index of its entity in MODEL.
    int entity = -1;
    bool may_penetrate = false;

    bool is_movable() const { return qpos >= 0 || mocap >= 0; }
  };

  const Part& MovablePart(const std::string& name) const;
  // Coordinates of a movable part: position and quaternion.
  double* Position(const Part& part) const;
  double* Quaternion(const Part& part) const;
  // Simulates the robot's initial steps, and then restores everything else.
  void MakeStartSteps();
  // Sets robot and parts to their poses without randomization.
  void SetHome();
  void PlaceAsRoboEval(int64_t seed, const Variation& variation, std::vector<Parameter>* parameters);
  void Spawn(const SpawnBox& box, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnPlane& plane, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnYaw& yaw, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const SpawnJoint& joint, Random* random, std::vector<Parameter>* parameters);
  void Spawn(const Distractors& distractors, Random* random, std::vector<Parameter>* parameters);
  // Sets the part's x and y, and z if `position` has three values.
  void Move(const Part& part, std::span<const double> position, std::vector<Parameter>* parameters);
  // Rotates a part about the vertical, relative to its own pose.
  void Turn(const Part& part, double yaw, std::vector<Parameter>* parameters);
  // Explains why the draw must be repeated, because a part penetrates another entity or two movable parts are
  // closer than a spawn box allows. Empty if the draw is valid.
  std::string Blocked(const Variation& variation);
  bool IsMovable(int entity) const;
  // Returns true for a part that may penetrate other parts in the reset state.
  bool MayPenetrate(int entity) const;
  // Returns true for geoms of a body that cannot move.
  bool IsStill(int geom) const;
  // Returns true if the contact of a movable part with another entity is not allowed in the reset state.
  bool CountsForParts(const mjContact& contact, int a, int b) const;
  // Returns a description of the deepest contact of more than 1 mm between two entities for which `counts`
  // returns true; empty if there is none. `counts` receives the contact and its two entities.
  std::string Deepest(const mjData& data,
                      const std::function<bool(const mjContact&, int, int)>& counts) const;
  // Computes everything that depends on positions and velocities. Also compensates gravity and Coriolis
  // forces on parked distractors, and on the arms if the robot has this compensation.
  void Prepare();
  // Adds the work of the last physics step (its torques times the motion at the velocities at its end), and
  // updates the peak torques.
  void AddWork();
  bool IsStable();

  // The compiled model, and a changed copy for this episode. The copy exists only if the variation changes
  // masses or friction.
  const mjModel* compiled_;
  ModelPtr changed_;
  const mjModel* model_;
  // Copy in which placed parts collide with each other; MuJoCo ignores contacts between bodies that cannot
  // move.
  ModelPtr spawn_model_;
  const model_info_t info_;
  int substeps_;
  int64_t tick_us_;
  bool gravity_compensation_;
  int start_steps_;
  DataPtr data_;
  // qpos just after the last physics step. The next mj_step1 normalizes its quaternions. A snapshot needs the
  // values from before, because normalizing twice would change their bits.
  std::vector<double> stepped_qpos_;
  std::vector<Arm> arms_;
  std::vector<Gripper> grippers_;
  std::vector<Part> parts_;
  ContactPoints contact_points_;
  ForceSums forces_;
  // Start positions of joints, other than the arms', that differ from their model file.
  struct Start {
    int qpos;
    double position;
  };
  std::vector<Start> starts_;
  // Degrees of freedom of distractors that are not in this episode; they float far away.
  std::vector<int> parked_dofs_;
  int64_t action_clips_ = 0;
  int64_t unreachable_poses_ = 0;
  int64_t singular_poses_ = 0;
  std::string instability_;
};

}  // namespace evalbus::sim
