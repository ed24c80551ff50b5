// Videos of episodes, made from their logs.
//
// Frame n shows the world at simulated time n / 30 s: the last STATE at or before it, with the scores of that
// tick. If the log has the episode's end, 30 frames follow that hold the last STATE and say how it ended.
#pragma once

#include <mujoco/mujoco.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "viz/images/frame.h"

namespace evalbus::viz {

class ParallelFrameRenderer;

inline constexpr int kVideoRate = 30;  // frames per second of simulated time
inline constexpr int kVideoHold = 30;  // frames at the end

// Which STATE each frame shows, without those at the end: for each n up to floor(30 T), T the last time, the
// index of the last time at or before n / 30 s. sim_time_us: increasing.
std::vector<size_t> VideoSchedule(const std::vector<int64_t>& sim_time_us);

// What a video shows: what one camera sees, with an overlay; or a main camera, insets, curves and an end card
// (viz/images/panel_video.h).
enum class VideoLayout { kPlain, kFull };
// As people name the full one, and its video.
inline constexpr char kFullLayout[] = "full";
// Throws InputError.
VideoLayout ParseVideoLayout(const std::string& name);

// "left_hand_wrist.mp4" for the camera "left/hand/wrist".
std::string VideoName(std::string camera, const std::string& ending = ".mp4");

// Throws InputError for a camera that the scene has not, and for two that make the same file.
void CheckCameras(const mjModel& model, const std::vector<std::string>& cameras);

struct VideoOptions {
  // Of the log; empty: all.
  std::vector<int> episodes;
  // Whose videos they are, written into the image; empty where that is not known.
  std::string policy;
  VideoLayout layout = VideoLayout::kPlain;
  // Which kind of video: .mp4, .gif or .webp (video_writer.h).
  std::string ending = ".mp4";
  // The video itself, where there is one only; empty: named by what it shows, in the folder.
  std::filesystem::path file;
  // Called often with the share of the log's videos that is done, 0 to 1.
  std::function<void(double)> progress;
};

// Records videos of what each camera sees, as large as the frame_renderer's frames, into FOLDER/<VideoName>,
// and returns these files; of the full layout there is one, "full.mp4", and without cameras it has
// FullCameras. Of a log with several episodes there is one video of each: "episode_0007_front.mp4", and
// "episode_0007_2_front.mp4" where there is a second try of it or a second run. The visual model is the file
// that MODEL names, or, when the run has been moved,
// ../../model/visual.mjb as seen from the log. Throws InputError (no such log or episode, cameras as above,
// log without MODEL or STATE), EnvironmentError.
std::vector<std::filesystem::path> MakeLogVideos(const std::filesystem::path& log,
                                                 const std::vector<std::string>& cameras,
                                                 ParallelFrameRenderer* frame_renderer,
                                                 const std::filesystem::path& folder,
                                                 const VideoOptions& options = {});

}  // namespace evalbus::viz
