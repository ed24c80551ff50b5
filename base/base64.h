// Encodes bytes as a string of letters, digits, + and / (RFC 4648), in one line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace evalbus {

std::string Base64(std::string_view bytes);
std::string Base64(const std::vector<uint8_t>& bytes);

}  // namespace evalbus
