// Files of the page. Its own files are embedded as text by CMake. The files of Debian's libjs-three are read
// from the folder in which this package, or the Python wheel of evalbus, has installed them.
#pragma once

#include <span>
#include <string>

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

}  // namespace evalbus::viz
