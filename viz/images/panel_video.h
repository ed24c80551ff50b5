// Videos with panels: one episode with everything that is known of it; two of them side by side; many in a
// grid. As everywhere, frame n shows simulated time n / 30 s; what is over holds its last image, and the
// end is held for kPanelHold frames.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viz/images/parallel_frame_renderer.h"
#include "viz/images/video_facts.h"
#include "viz/images/video_layout.h"

namespace evalbus::viz {

inline constexpr int kPanelHold = 60;

// An episode, of which only what is shown is kept.
struct VideoEpisode {
  std::filesystem::path log;
  model_info_t model;
  std::optional<int64_t> seed;
  // One for each frame.
  std::vector<state_t> states;
  VideoFacts facts;
  // In a grid or beside another: whose it is.
  std::string name;
};

// Throws InputError for a MODEL that contradicts itself.
VideoEpisode ToVideoEpisode(const RecordedEpisode& episode, const std::string& policy,
                            const std::filesystem::path& log);
// Those of a log: of these numbers, or all. Throws InputError as MakeLogVideos does.
std::vector<VideoEpisode> ReadVideoEpisodes(const std::filesystem::path& log,
                                            const std::vector<int>& episodes, const std::string& policy);

// The cameras of a full video where none are named: overview, then the head's and the wrists'.
std::vector<std::string> FullCameras(const mjModel& model);

using VideoProgress = std::function<void(double share)>;

// The first camera is the main one; the video is as large as the frame_renderer's frames. Throws InputError
// (too many or unknown cameras, size, file), EnvironmentError; so do the others. No file is left
// half-written.
void MakeFullVideo(const VideoEpisode& episode, const std::vector<std::string>& cameras,
                   ParallelFrameRenderer* frame_renderer, const std::filesystem::path& file,
                   const VideoProgress& progress);

struct JointVideoOptions {
  std::string title, subtitle;
  std::string camera = kDefaultCamera;
  FrameSize size{1280, 720};
  // Of a grid.
  GridShape shape;
  VideoProgress progress;
};
// Two.
void MakePairVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file);
// As many as the grid has cells, or fewer.
void MakeGridVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file);

}  // namespace evalbus::viz
