// Finds actuators whose velocity gain is too high for the timestep.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/robot_description.h"

namespace evalbus {

// Returns a line for each actuator of the robot whose velocity gain reverses the joint's velocity at every
// step, with the robot at home. Euler's method applies a velocity gain explicitly: with the gain b, the
// timestep h and the inertia m that the actuator moves, a step multiplies the velocity by 1 - h b / m.
std::vector<std::string> FindVibration(const RobotDescription& robot, const model_info_t& info,
                                       const mjModel& model);

}  // namespace evalbus
