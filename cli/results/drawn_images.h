// Images of every state of episodes, drawn from their logs on all cores. Each episode's are kept in a
// folder until they are no longer needed, so that who is stopped goes on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace evalbus::results {

struct ImageOptions {
  std::vector<std::string> cameras;
  int width = 256, height = 256;
};

class DrawnImages {
 public:
  // folder: for what is drawn, made when needed.
  DrawnImages(std::vector<std::filesystem::path> logs, ImageOptions options, std::filesystem::path folder);

  // Draws what the folder has not. `progress` gets the share that is there, from 0 to 1, now and then.
  // Throws InputError for an unknown camera, before anything is drawn, and for a log; EnvironmentError where
  // OpenGL, the disk or the user stops it.
  void Draw(const std::function<void(double)>& progress);

  // Of the i-th log, deflated (zlib) images of height x width x RGB: the cameras of tick 0, of tick 1, ...
  std::vector<std::string> Of(size_t i) const;

  void RemoveAll() const;

 private:
  class Painter;

  std::vector<std::filesystem::path> logs_;
  ImageOptions options_;
  std::filesystem::path folder_;
  // Where each log's are. The name holds what they depend on: the log's content, the cameras, the size.
  std::vector<std::filesystem::path> files_;
};

}  // namespace evalbus::results
