// Files of the page, and data packed into it. The page's own files are embedded as text by CMake. The files
// of Debian's libjs-three are read from the folder in which this package, or the Python wheel of evalbus, has
// installed them.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace evalbus::viz {

struct PageFile {
  const char* name;  // "scene.js"
  const char* text;
};
// Returns the scripts in load order, then viewer.css. three.js and OrbitControls.js must be loaded before the
// scripts.
std::span<const PageFile> PageFiles();
// Returns the content of viewer.css; empty if it is missing.
std::string PageStyle();

struct ThreeJs {
  std::string three, orbit_controls;
};
// Reads the files of three.js. If they are missing, throws EnvironmentError with the package to install.
ThreeJs ReadThreeJs();

// Compresses in zlib format (deflate with zlib header). level: see zlib; -1 is its default.
std::string Deflated(std::string_view bytes, int level = -1);
// Deflates a block, and encodes it in base64.
std::string Packed(const std::string& block);

// Data of a viewer that is embedded in a page, so that the page can be opened from disk.
struct PackedViewer {
  // Names (docs/viewer_data.md) and contents of Packed() blocks.
  std::vector<std::pair<std::string, std::string>> blocks;
  ThreeJs libraries;
  // A sentence about the episodes that the page contains.
  std::string note;
};

}  // namespace evalbus::viz
