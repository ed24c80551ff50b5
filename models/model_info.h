// Describes a compiled scene as MODEL: the meaning of the ids in messages.
#pragma once

#include <mujoco/mujoco.h>

#include "evalbus/model_info_t.hpp"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus {

// model: the physics model composed of task and robot. Fills names, entities, arms, grippers, objects,
// timestep, time limit, task, instruction and robot. Leaves the fields of the run (such as session, run_id,
// variation, files, hashes, clock and substeps) for the sim. Elements without a name are named
// "<body>/geom<N>" or "<body>/joint<N>", where N counts within the body. Throws InputError if the model does
// not fit the task or the robot.
model_info_t DescribeModel(const TaskDescription& task, const RobotDescription& robot, const mjModel& model);

// Name of an entry in a model's <custom> section. The entry is 0 if the robot's controller does not
// compensate gravity, so that the servos must hold the arms.
inline constexpr const char* kGravityCompensation = "gravity_compensation";

// Returns whether the sim compensates gravity and Coriolis forces of the arms. True if the model does not
// have the number kGravityCompensation.
bool CompensatesGravity(const mjModel& model);

}  // namespace evalbus
