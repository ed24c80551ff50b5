// Videos with panels: one episode with all its scores and events, two episodes side by side, or many in a
// grid. Frame n shows simulated time n / 30 s, or that of another timing. An episode that has ended keeps
// showing its last image; after the last episode has ended, the final image is held for kPanelHold frames.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "viz/images/parallel_frame_renderer.h"
#include "viz/images/video_facts.h"
#include "viz/images/video_layout.h"
#include "viz/images/video_timing.h"

namespace evalbus::viz {

inline constexpr int kPanelHold = 60;

// The parts of a recorded episode that a video shows.
struct VideoEpisode {
  std::filesystem::path log;
  model_info_t model;
  std::optional<int64_t> seed;
  // One state and its time per frame.
  std::vector<state_t> states;
  std::vector<FrameTime> times;
  // Whether the video shows how the episode ended, or is cut before that.
  bool shows_end = true;
  VideoFacts facts;
  // Label in a grid or pair, e.g. the policy.
  std::string name;
};

// Throws InputError if MODEL is inconsistent.
VideoEpisode ToVideoEpisode(const EpisodeMessages& episode, const std::string& policy,
                            const std::filesystem::path& log, const VideoTiming& timing);
// Returns the episodes of a log with these numbers; all if `episodes` is empty. Throws InputError as
// MakeLogVideos does.
std::vector<VideoEpisode> ReadVideoEpisodes(const std::filesystem::path& log,
                                            const std::vector<int>& episodes, const std::string& policy,
                                            const VideoTiming& timing = {});
// Returns the decisive moment of an episode in a log, s. Throws InputError if the log does not have it.
double ReadDecisiveMoment(const std::filesystem::path& log, int episode);

// Returns the default cameras of a full video: overview, head, wrists.
std::vector<std::string> FullCameras(const mjModel& model);

using VideoProgress = std::function<void(double share)>;

// The first camera is the main one. The video has the size of the frame_renderer's frames. This and the
// following functions throw InputError (too many or unknown cameras, invalid size or file name) and
// EnvironmentError. They never leave an incomplete file.
void MakeFullVideo(const VideoEpisode& episode, const std::vector<std::string>& cameras,
                   ParallelFrameRenderer* frame_renderer, const std::filesystem::path& file,
                   const VideoProgress& progress);

struct JointVideoOptions {
  std::string title, subtitle;
  std::string camera = kDefaultCamera;
  FrameSize size{1280, 720};
  // Only used by MakeGridVideo.
  GridShape shape;
  VideoProgress progress;
};
// Requires exactly two episodes.
void MakePairVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file);
// Requires at most as many episodes as the grid has cells.
void MakeGridVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file);

}  // namespace evalbus::viz
