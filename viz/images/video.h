// Records videos of episodes from their logs.
//
// Frame n shows simulated time n / 30 s, unless a different timing is selected (video_timing.h). It shows the
// last STATE at or before that time, with the scores of its tick. If the video shows the episode's end, 30
// more frames show the last STATE with the outcome.
#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "viz/images/frame.h"
#include "viz/images/overlay.h"
#include "viz/images/video_timing.h"

namespace evalbus::viz {

class ParallelFrameRenderer;

inline constexpr int kVideoHold = 30;  // number of frames that show the end

// kPlain: one camera's image with an overlay. kFull: a main camera, insets, curves and an end card
// (viz/images/panel_video.h).
enum class VideoLayout { kPlain, kFull };
// Name of the full layout on the command line, and file stem of its video.
inline constexpr char kFullLayout[] = "full";
// Parses the name of a layout. Throws InputError if it is unknown.
VideoLayout ParseVideoLayout(const std::string& name);

// Returns the file name for a camera, such as "left_hand_wrist.mp4" for "left/hand/wrist".
std::string VideoName(std::string camera, const std::string& ending = ".mp4");

// Throws InputError if the scene lacks a camera or if two cameras map to the same file name.
void CheckCameras(const mjModel& model, const std::vector<std::string>& cameras);

struct VideoOptions {
  // Numbers of the episodes in the log. Empty: all episodes.
  std::vector<int> episodes;
  // Policy name, written into the image; empty if unknown.
  std::string policy;
  VideoLayout layout = VideoLayout::kPlain;
  // Used by the plain layout only.
  OverlayAmount overlay = OverlayAmount::kFull;
  // Length of the wrists' trails in simulated time, s (viz/images/trail.h). Used by the plain layout only.
  double trail_s = 0;
  VideoTiming timing;
  // File format: .mp4, .gif or .webp (video_writer.h).
  std::string ending = ".mp4";
  // Output file if only one video is made. Empty: a file in the folder, named after its content.
  std::filesystem::path file;
  // Called repeatedly with the completed share of the log's videos, 0 to 1.
  std::function<void(double)> progress;
};

// Records one video per camera in the size of the frame_renderer's frames, and returns the files
// FOLDER/<VideoName>. The full layout makes a single video, "full.mp4"; without cameras it uses FullCameras.
// If a log has several episodes, each has its own video: "episode_0007_front.mp4", or
// "episode_0007_2_front.mp4" for a second attempt or a second run. The file name of a video with a different
// timing contains the NameSuffix of the timing, so that it does not replace the video of the whole episode.
// The visual model is loaded by VisualModel() (viz/images/log_episodes.h). Throws InputError (unknown log or
// episode, cameras as in CheckCameras, log without MODEL or STATE) and EnvironmentError.
std::vector<std::filesystem::path> MakeLogVideos(const std::filesystem::path& log,
                                                 const std::vector<std::string>& cameras,
                                                 ParallelFrameRenderer* frame_renderer,
                                                 const std::filesystem::path& folder,
                                                 const VideoOptions& options = {});

}  // namespace evalbus::viz
