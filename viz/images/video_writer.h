// Encodes frames into a video by the ffmpeg program, of the kind that the file's name ends in: H.264 in a
// fragmented MP4; GIF or WebP, which repeat themselves, at 10 frames a second. Equal frames give equal bytes
// (of one version of ffmpeg).
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "bus/wait.h"
#include "viz/images/frame.h"

namespace evalbus::viz {

// ".mp4", ".gif", ".webp"; throws InputError for others.
void CheckVideoEnding(const std::string& ending);

class VideoWriter {
 public:
  // The file is made by Close, whole. Throws InputError for an odd size and an unknown ending,
  // EnvironmentError if ffmpeg is missing, fails, or does nothing for longer than `timeout`; so do the
  // others.
  VideoWriter(const std::filesystem::path& file, FrameSize size, int frames_per_second,
              std::chrono::milliseconds timeout = std::chrono::seconds(60));
  // Without Close: the video is thrown away.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void Write(const Frame& frame);
  // Waits for ffmpeg and writes the video.
  void Close();

 private:
  // Ends ffmpeg; its exit code and what it said.
  int End(std::string* message);
  void CheckTimeout(Wait* waiting) const;
  void CloseFiles();
  [[noreturn]] void Fail(const std::string& message) const;

  std::filesystem::path file_;
  FrameSize size_;
  std::chrono::milliseconds timeout_;
  pid_t ffmpeg_ = -1;
  // Frames go in, the video and complaints come out.
  int frames_ = -1, video_ = -1, complaints_ = -1;
};

}  // namespace evalbus::viz
