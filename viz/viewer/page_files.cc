#include "viz/viewer/page_files.h"

#include <fstream>
#include <iterator>
#include <string_view>

#include "base/errors.h"

namespace evalbus::viz {
namespace {

// Folder in which Debian's libjs-three installs three.js.
constexpr char kFolder[] = "/usr/share/javascript/three/";

std::string Read(const std::string& name) {
  std::ifstream file(kFolder + name, std::ios::binary);
  if (!file) {
    throw EnvironmentError("the viewer needs three.js: install it with 'apt-get install libjs-three' (no " +
                           (kFolder + name) + ")");
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
