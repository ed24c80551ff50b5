// SHA-256 of files.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// 64 lower-case hexadecimal digits. Throws InputError if the file cannot be read.
std::string Sha256File(const std::filesystem::path& file);

}  // namespace evalbus
