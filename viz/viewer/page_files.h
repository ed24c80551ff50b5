// The page's own files, turned into text by CMake, and those of Debian's libjs-three, which are read where
// they are installed.
#pragma once

#include <span>
#include <string>

namespace evalbus::viz {

struct PageFile {
  const char* name;  // "scene.js"
  const char* text;
};
// Scripts in the order in which they are loaded, each behind three.js and OrbitControls.js; then viewer.css.
std::span<const PageFile> PageFiles();
// That of viewer.css; empty where there is none.
std::string PageStyle();

struct ThreeJs {
  std::string three, orbit_controls;
};
// Throws EnvironmentError, with what to install, where they are missing.
ThreeJs ReadThreeJs();

}  // namespace evalbus::viz
