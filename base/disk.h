// What a disk says about itself.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Why nothing can be written into the folder, for who could not even write that down: "no space left on the
// disk of runs/a"; empty where something can.
std::string WhyNotWritable(const std::filesystem::path& folder);

}  // namespace evalbus
