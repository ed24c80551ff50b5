// Encodes frames into a video with the ffmpeg program. The file extension selects the format: H.264 in
// fragmented MP4, or looping GIF or WebP at 10 frames per second. With the same ffmpeg version, equal frames
// give equal bytes.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "bus/wait.h"
#include "viz/images/frame.h"

namespace evalbus::viz {

// Throws InputError unless the ending is ".mp4", ".gif" or ".webp".
void CheckVideoEnding(const std::string& ending);

class VideoWriter {
 public:
  // The file is created atomically by Close. Throws InputError for an odd size or an unknown ending. All
  // members throw EnvironmentError if ffmpeg is missing, fails, or makes no progress for longer than
  // `timeout`.
  VideoWriter(const std::filesystem::path& file, FrameSize size, int frames_per_second,
              std::chrono::milliseconds timeout = std::chrono::seconds(60));
  // Discards the video if Close has not been called.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void Write(const Frame& frame);
  // Waits for ffmpeg and writes the file.
  void Close();

 private:
  // Ends ffmpeg. Returns its exit code, and its error message in *message.
  int End(std::string* message);
  void CheckTimeout(Wait* waiting) const;
  void CloseFiles();
  [[noreturn]] void Fail(const std::string& message) const;

  std::filesystem::path file_;
  FrameSize size_;
  std::chrono::milliseconds timeout_;
  pid_t ffmpeg_ = -1;
  // frames_: socket for input frames. video_: memory file with ffmpeg's output. complaints_: memory file with
  // ffmpeg's error messages.
  int frames_ = -1, video_ = -1, complaints_ = -1;
};

}  // namespace evalbus::viz
