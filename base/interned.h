// Names of which thousands of records have the same ones.
#pragma once

#include <string_view>

namespace evalbus {

// The one copy of this text, which is there as long as the program runs. From any thread.
std::string_view Interned(std::string_view text);

}  // namespace evalbus
