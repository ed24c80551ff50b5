// Draws the frames of videos in several processes and hands them over in their order: a video is the same
// whatever their number.
//
// Processes, not threads: Mesa draws one image at a time in each process. They are forked when this process
// has drawn the first frame, so that the scene, OpenGL's context and its compiled shaders are made once.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "viz/images/renderer.h"

namespace evalbus::viz {

// A renderer for each scene. Where a task draws colors, lights or cameras, each episode has its own.
class VideoScenes {
 public:
  explicit VideoScenes(FrameSize largest) : largest_(largest) {}

  // Of an episode in a log, with its seed if that is known. Throws InputError as VisualModel and
  // Renderer::SetAppearance.
  Renderer* Of(const model_info_t& model, const std::filesystem::path& log, std::optional<int64_t> seed);
  // Those that were not asked for since the last call.
  void FreeUnused();

 private:
  struct Scene {
    std::unique_ptr<Renderer> renderer;
    bool varies = false, is_used = false;
    std::optional<int64_t> seed;
  };
  FrameSize largest_;
  // By the visual model's SHA-256, the variation and the task.
  std::map<std::string, Scene> scenes_;
};

// Made, used and freed in one thread.
class ParallelFrameRenderer {
 public:
  // Frame n, of each video that is made at once; as many and as large for each n.
  using DrawFrames = std::function<std::vector<Frame>(size_t n)>;
  // Called once for each video.
  using Begin = std::function<DrawFrames(VideoScenes*)>;

  // Images are drawn no larger than this. processes: as many as there are cores, but not more than 8,
  // unless said; one where a graphics processor draws.
  explicit ParallelFrameRenderer(FrameSize largest, size_t processes = 0);

  FrameSize largest() const { return largest_; }
  // Calls take for frames 0 to num_frames - 1, in this process, while later ones are drawn. Throws what
  // drawing throws (InputError, EnvironmentError, else std::runtime_error), and EnvironmentError where a
  // process dies or this one is asked to stop.
  void Render(size_t num_frames, const Begin& begin,
              const std::function<void(size_t n, const std::vector<Frame>&)>& take);

 private:
  FrameSize largest_;
  size_t processes_;
  VideoScenes scenes_;
};

}  // namespace evalbus::viz
