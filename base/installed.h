// Finds the folders in which this program and its data are installed.
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Returns the folder that contains this program.
std::filesystem::path ProgramFolder();

// Returns ../share/evalbus/`name`, relative to the program's folder, if it exists, otherwise `otherwise`. An
// installed evalbus has its models there. A Python wheel also has the data of packages on which the Debian
// package depends.
std::filesystem::path SharedData(const std::string& name, const std::filesystem::path& otherwise);

}  // namespace evalbus
