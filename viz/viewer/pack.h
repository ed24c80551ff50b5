// Packs blocks into a page. Each block is deflated and base64-encoded.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "viz/viewer/page_files.h"

namespace evalbus::viz {

// Compresses in zlib format (deflate with zlib header).
std::string Deflated(const std::string& bytes);
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
