// Stores names only once, even if thousands of records contain them.
#pragma once

#include <string_view>

namespace evalbus {

// Returns the only copy of this text, which exists as long as the program runs. Thread-safe.
std::string_view Interned(std::string_view text);

}  // namespace evalbus
