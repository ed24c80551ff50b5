// Counts calls of operator new and the requested bytes, in the test executable that links
// allocation_count.cc.
#pragma once

#include <cstdint>

namespace evalbus {

int64_t AllocationCount();
int64_t AllocatedBytes();

}  // namespace evalbus
