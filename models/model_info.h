// Describes a compiled scene as MODEL does: what the ids in messages stand for.
#pragma once

#include <mujoco/mujoco.h>

#include "evalbus/model_info_t.hpp"
#include "models/robot_description.h"
#include "models/task_description.h"

namespace evalbus {

// model: the physics model composed of task and robot. Fills names, entities, arms, grippers, objects,
// timestep, time limit, task and robot; the run's own fields (run_id, variation, files, hashes, clock,
// substeps) are left for the sim. What has no name is called "<body>/geom<N>" or "<body>/joint<N>", N
// counting within the body. Throws InputError where the model does not fit the robot.
model_info_t DescribeModel(const TaskDescription& task, const RobotDescription& robot, const mjModel& model);

}  // namespace evalbus
