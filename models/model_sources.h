// Folders in which the MJCF files that a task or robot description names are searched.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "models/yaml_reader.h"

namespace evalbus {

// Options of all commands that compose a scene.
struct ModelSources {
  // --model-path: folders that are searched for a robot's models.
  std::vector<std::filesystem::path> model_path = {};
  // --assets: "NAME=FOLDER". A description refers to a file in FOLDER as "NAME:FILE".
  std::vector<std::string> assets = {};
};

// Returns true if the text is "NAME:FILE", which refers to a file of assets that are not part of evalbus.
bool IsAssetFile(const std::string& text);

// Returns the path of "NAME:FILE". Throws InputError at `where` if no assets with this name were given, or if
// FILE does not exist.
std::filesystem::path AssetFile(const std::string& text, const SourceLocation& where,
                                const ModelSources& sources);

// Makes the folders absolute. Throws InputError if an entry is not NAME=FOLDER, or FOLDER is not a folder.
std::vector<std::string> AbsoluteAssets(const std::vector<std::string>& assets);

}  // namespace evalbus
