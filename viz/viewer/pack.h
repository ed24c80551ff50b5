// Blocks in a page: each as the base64 of its deflated bytes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "viz/viewer/page_files.h"

namespace evalbus::viz {

// zlib's, whose header says so.
std::string Deflated(const std::string& bytes);
std::string Packed(const std::string& block);

// A viewer in a page that opens from disk.
struct PackedViewer {
  // Names as docs/viewer_data.md has them, and Packed() blocks.
  std::vector<std::pair<std::string, std::string>> blocks;
  ThreeJs libraries;
  // Which episodes it has, a sentence.
  std::string note;
};

}  // namespace evalbus::viz
