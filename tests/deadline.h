// The one limit of everything that tests wait for.
#pragma once

#include <chrono>

namespace evalbus {

// Only a hang reaches this limit: it is far above what anything here takes on a loaded machine or under a
// sanitizer. TEST_TIMEOUT_S in tests/CMakeLists.txt is above it, so that the test fails with its own message.
inline constexpr std::chrono::seconds kDeadline{900};

}  // namespace evalbus
