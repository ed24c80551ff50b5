// Stores names that thousands of records share only once.
#pragma once

#include <string_view>

namespace evalbus {

// The only copy of this text, which lives as long as the program. Thread-safe.
std::string_view Interned(std::string_view text);

}  // namespace evalbus
