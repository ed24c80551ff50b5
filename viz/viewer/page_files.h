// The page's own files, embedded as text by CMake, and the files of Debian's libjs-three, which are read
// where the package, or the Python wheel of evalbus, has installed them.
#pragma once

#include <span>
#include <string>

namespace evalbus::viz {

struct PageFile {
  const char* name;  // "scene.js"
  const char* text;
};
// Scripts in load order (three.js and OrbitControls.js must be loaded before them), then viewer.css.
std::span<const PageFile> PageFiles();
// Content of viewer.css; empty if it is missing.
std::string PageStyle();

struct ThreeJs {
  std::string three, orbit_controls;
};
// Throws EnvironmentError, with the package to install, if the files are missing.
ThreeJs ReadThreeJs();

}  // namespace evalbus::viz
