// Where MJCF files are searched that a task or robot description names.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "models/yaml_reader.h"

namespace evalbus {

// The two options of commands that compose a scene.
struct ModelSources {
  // --model-path: folders that are searched for a robot's models.
  std::vector<std::filesystem::path> model_path = {};
  // --assets: "NAME=FOLDER". A description refers to a file in FOLDER as "NAME:FILE".
  std::vector<std::string> assets = {};
};

// True if the text is "NAME:FILE": a file of assets, which are not part of evalbus.
bool IsAssetFile(const std::string& text);

// Path of "NAME:FILE". Throws InputError at `where` if no assets with this name were given, or FILE is not
// there.
std::filesystem::path AssetFile(const std::string& text, const SourceLocation& where,
                                const ModelSources& sources);

// Makes the folders absolute. Throws InputError if an entry is not NAME=FOLDER, or FOLDER is not a folder.
std::vector<std::string> AbsoluteAssets(const std::vector<std::string>& assets);

}  // namespace evalbus
