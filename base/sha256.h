// Computes the SHA-256 of files and strings, as 64 lower-case hexadecimal digits.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace evalbus {

// Throws the errors of InputFile (base/input_file.h).
std::string Sha256File(const std::filesystem::path& file);
std::string Sha256Text(std::string_view text);

}  // namespace evalbus
