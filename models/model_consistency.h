// Checks a MODEL of unknown origin, so that its numbers can safely be used as indices.
#pragma once

#include "evalbus/model_info_t.hpp"

namespace evalbus {

// Throws InputError if an index is out of range, the tick is implausible, or the range of an arm's joint is
// invalid.
void CheckConsistency(const model_info_t& info);

// Throws InputError if a joint's index exceeds the number of coordinates of a STATE.
void CheckCoordinates(const model_info_t& info, int num_coordinates);

}  // namespace evalbus
