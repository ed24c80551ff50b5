// Encodes frames into a film: H.264 in a fragmented MP4, by the ffmpeg program. Equal frames give equal bytes
// (of one version of ffmpeg).
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "viz/pictures/frame.h"

namespace evalbus::viz {

class VideoWriter {
 public:
  // Until Close the film is called NAME.partial.mp4; even cut, it plays up to there. Throws InputError for an
  // odd size, EnvironmentError if ffmpeg is missing or fails; so do the others.
  VideoWriter(const std::filesystem::path& file, FrameSize size, int frames_per_second);
  // Without Close: the film is thrown away.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void Write(const Frame& frame);
  // Waits for ffmpeg and gives the film its name.
  void Close();

 private:
  // Ends ffmpeg; its exit code and what it said.
  int Wait(std::string* message);
  [[noreturn]] void Fail(const std::string& message);

  std::filesystem::path file_, partial_;
  FrameSize size_;
  pid_t ffmpeg_ = -1;
  // Frames go in, complaints come out.
  int frames_ = -1, complaints_ = -1;
};

}  // namespace evalbus::viz
