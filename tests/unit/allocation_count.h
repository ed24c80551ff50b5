// Counts calls of operator new in the test executable that links allocation_count.cc.
#pragma once

#include <cstdint>

namespace evalbus {

int64_t AllocationCount();

}  // namespace evalbus
