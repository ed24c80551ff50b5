// Renders images of every state of recorded episodes from their logs, on all cores. Finished episodes are
// cached in a folder, so that an interrupted export can resume.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace evalbus::exports {

struct ImageOptions {
  std::vector<std::string> cameras;
  int width = 256, height = 256;
};

class DrawnImages {
 public:
  // `folder`: folder of the cache, which is created when needed.
  DrawnImages(std::vector<std::filesystem::path> logs, ImageOptions options, std::filesystem::path folder);

  // Renders the images that are not cached. `progress` receives the finished fraction, from 0 to 1. Throws
  // InputError for an unknown camera, before anything is rendered, and for an unusable log. Throws
  // EnvironmentError if OpenGL or the disk fails, or if the user requests a stop.
  void Draw(const std::function<void(double)>& progress);

  // Returns the images of the i-th log as deflated (zlib) height x width x RGB, ordered by tick and then by
  // camera.
  std::vector<std::string> Of(size_t i) const;

  void RemoveAll() const;

 private:
  class Painter;

  std::vector<std::filesystem::path> logs_;
  ImageOptions options_;
  std::filesystem::path folder_;
  // Cache file of each log. The name contains a hash of the log's content, the cameras and the size.
  std::vector<std::filesystem::path> files_;
};

}  // namespace evalbus::exports
