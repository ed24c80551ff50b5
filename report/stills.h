// Draws images of single moments of episodes, for pages.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "viz/images/jpeg.h"
#include "viz/images/parallel_frame_renderer.h"

namespace evalbus::report {

// Maximum number of images on a page. Together they take about 0.3 MB and, with software rendering, 2 s.
inline constexpr size_t kMaxStills = 12;

class StillRenderer {
 public:
  StillRenderer();

  // Returns the scene of an episode at this time (after its end: the last state), seen from the default
  // camera, as a data URL with a JPEG image. run: folder of the run. Throws InputError if the log cannot be
  // read or lacks the episode, EnvironmentError if OpenGL is missing or fails.
  std::string DrawMoment(const std::filesystem::path& run, int episode, double time_s);

 private:
  viz::VideoScenes scenes_;
  viz::JpegEncoder encoder_;
};

}  // namespace evalbus::report
