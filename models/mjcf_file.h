// Reads MJCF files as XML (tinyxml2), before MuJoCo compiles them.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>

namespace evalbus {

// An MJCF file with its includes expanded. Every element has the attribute kSourceAttribute = "file:line",
// because tinyxml2 loses line numbers when an element moves to another document.
struct MjcfFile {
  std::filesystem::path file;
  std::unique_ptr<tinyxml2::XMLDocument> document;
  tinyxml2::XMLElement* root = nullptr;
};
inline constexpr const char* kSourceAttribute = "evalbus_source";
// Density (kg/m^3) of a geom whose mass MuJoCo infers from the volume of its mesh.
inline constexpr const char* kDensityAttribute = "evalbus_density";

// Throws InputError if a file cannot be read, is not XML or not MJCF, or if an include is missing or
// recursive.
MjcfFile ReadMjcf(const std::filesystem::path& file);

// Returns "file:line" of an element of an MjcfFile.
std::string SourceOf(const tinyxml2::XMLElement* element);

// Returns the names of the elements <kind name="..."> below `section` ("worldbody", "actuator", "asset",
// ...). kind "*" stands for any element.
std::set<std::string> NamesIn(const MjcfFile& mjcf, const std::string& section, const std::string& kind);

}  // namespace evalbus
