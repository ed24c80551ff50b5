// JSON files from outside, whose mistakes are to be found.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace evalbus {

// Reads a JSON file. Throws InputError: file, line and reason. NaN, infinities and repeated keys are refused.
nlohmann::json ReadJsonFile(const std::filesystem::path& file);

}  // namespace evalbus
