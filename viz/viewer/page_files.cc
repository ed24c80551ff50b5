#include "viz/viewer/page_files.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "base/errors.h"
#include "base/installed.h"

namespace evalbus::viz {
namespace {

// Folder in which Debian's libjs-three installs three.js.
constexpr char kDebiansFolder[] = "/usr/share/javascript/three";

std::string Read(const std::string& name) {
  const std::filesystem::path path = SharedData("three", kDebiansFolder) / name;
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw EnvironmentError("the viewer needs three.js: install it with 'apt-get install libjs-three' (no " +
                           path.string() + ")");
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

std::string PageStyle() {
  for (const PageFile& file : PageFiles()) {
    if (file.name == std::string_view("viewer.css")) return file.text;
  }
  return "";
}

ThreeJs ReadThreeJs() {
  return {.three = Read("three.min.js"), .orbit_controls = Read("examples/js/controls/OrbitControls.js")};
}

}  // namespace evalbus::viz
