// Bytes as text of letters, digits, + and / (RFC 4648), in one line.
#pragma once

#include <string>
#include <string_view>

namespace evalbus {

std::string Base64(std::string_view bytes);

}  // namespace evalbus
