// The usual timeout of waits in tests.
#pragma once

#include <chrono>

namespace evalbus {

// Only a hang reaches this timeout, because it is far longer than any test takes on a loaded machine or under
// a sanitizer. TEST_TIMEOUT_S in tests/CMakeLists.txt is longer, so that the test fails with its own message.
inline constexpr std::chrono::seconds kDeadline{900};

}  // namespace evalbus
