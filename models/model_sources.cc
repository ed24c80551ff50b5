#include "models/model_sources.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "base/errors.h"

namespace evalbus {
namespace {

// Splits "roboeval=/home/me/RoboEval" into "roboeval" and "/home/me/RoboEval".
std::pair<std::string, std::filesystem::path> NameAndFolder(const std::string& entry) {
  const size_t equals = entry.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == entry.size()) {
    throw InputError("--assets: expected NAME=FOLDER, got '" + entry + "'");
  }
  return {entry.substr(0, equals), entry.substr(equals + 1)};
}

}  // namespace

bool IsAssetFile(const std::string& text) {
  const size_t colon = text.find(':');
  const auto is_in_name = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
  return colon != std::string::npos && colon > 0 &&
         std::all_of(text.begin(), text.begin() + static_cast<long>(colon), is_in_name);
}

std::filesystem::path AssetFile(const std::string& text, const SourceLocation& where,
                                const ModelSources& sources) {
  const size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  for (const std::string& entry : sources.assets) {
    const auto [own, folder] = NameAndFolder(entry);
    if (own != name) continue;
    const std::filesystem::path file =
        (std::filesystem::absolute(folder) / text.substr(colon + 1)).lexically_normal();
    if (!std::filesystem::is_regular_file(file)) {
      throw InputError(where.ToString() + ": --assets " + name + ": file " + file.string() +
                       " does not exist");
    }
    return file;
  }
  throw InputError(where.ToString() + ": '" + text +
                   "' is not part of evalbus; pass the folder that contains it, with --assets " + name +
                   "=FOLDER");
}

std::vector<std::string> AbsoluteAssets(const std::vector<std::string>& assets) {
  std::vector<std::string> result;
  for (const std::string& entry : assets) {
    const auto [name, folder] = NameAndFolder(entry);
    if (!std::filesystem::is_directory(folder)) {
      throw InputError("--assets " + name + ": " + folder.string() + " is not a folder");
    }
    result.push_back(name + "=" + std::filesystem::absolute(folder).lexically_normal().string());
  }
  return result;
}

}  // namespace evalbus
