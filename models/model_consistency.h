// Whether MODEL, which may come from anybody, can be relied upon where its numbers are indices.
#pragma once

#include "evalbus/model_info_t.hpp"

namespace evalbus {

// Throws InputError if an index points beyond what the message counts, or a range of an arm's joint is none.
void CheckConsistency(const model_info_t& info);

// Throws InputError if a joint has no place among so many coordinates of a STATE.
void CheckCoordinates(const model_info_t& info, int num_coordinates);

}  // namespace evalbus
