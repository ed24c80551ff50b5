// Videos with panels: one episode with all its scores and events, two episodes side by side, or many episodes
// in a grid. Frame n shows simulated time n / 30 s, unless a different timing is selected. After an episode
// has ended, its last image stays visible. After all episodes have ended, the final image is held for
// kPanelHold frames (in a video of one episode only if the video shows how it ended).
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
  // States and times of the frames, one entry per frame.
  std::vector<state_t> states;
  std::vector<FrameTime> times;
  // True if the video shows how the episode ended. False if it is cut before the end.
  bool shows_end = true;
  VideoFacts facts;
  // Label in a grid or pair, e.g. the policy.
  std::string name;
};

// Converts an episode. Throws InputError if MODEL is inconsistent.
VideoEpisode ToVideoEpisode(const EpisodeMessages& episode, const std::string& policy,
                            const std::filesystem::path& log, const VideoTiming& timing);
// Returns the episodes of a log with these numbers, or all episodes if `episodes` is empty. Throws the errors
// of MakeLogVideos().
std::vector<VideoEpisode> ReadVideoEpisodes(const std::filesystem::path& log,
                                            const std::vector<int>& episodes, const std::string& policy,
                                            const VideoTiming& timing = {});
// Returns the decisive moment of an episode in a log, s. Throws InputError if the log does not have it.
double ReadDecisiveMoment(const std::filesystem::path& log, int episode);

// Returns the default cameras of a full video: overview, head and wrists.
std::vector<std::string> FullCameras(const mjModel& model);

using VideoProgress = std::function<void(double share)>;

// Makes a full video. The first camera is the main camera. The video has the size of the frame_renderer's
// frames. This and the following functions throw InputError (too many or unknown cameras, invalid size or
// file name) and EnvironmentError. They never leave an incomplete file.
void MakeFullVideo(const VideoEpisode& episode, const std::vector<std::string>& cameras,
                   ParallelFrameRenderer* frame_renderer, const std::filesystem::path& file,
                   const VideoProgress& progress);

struct JointVideoOptions {
  std::string title, subtitle;
  std::string camera = kDefaultCamera;
  FrameSize size{1280, 720};
  // Used only by MakeGridVideo.
  GridShape shape;
  VideoProgress progress;
};
// Makes a video of two episodes side by side. Requires exactly two episodes.
void MakePairVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file);
// Makes a video of episodes in a grid. The grid must have at least as many cells as there are episodes.
void MakeGridVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file);

}  // namespace evalbus::viz
