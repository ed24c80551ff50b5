#include "viz/viewer/page_files.h"

#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/base64.h"
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
    throw EnvironmentError(
        "the viewer requires three.js: install it with 'apt-get install libjs-three' (no " + path.string() +
        ")");
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

std::string Deflated(std::string_view bytes, int level) {
  uLongf length = compressBound(bytes.size());
  std::string deflated(length, '\0');
  if (compress2(reinterpret_cast<Bytef*>(deflated.data()), &length,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), level) != Z_OK) {
    throw EnvironmentError("zlib: out of memory");
  }
  deflated.resize(length);
  return deflated;
}

std::string Packed(const std::string& block) { return Base64(Deflated(block)); }

}  // namespace evalbus::viz
