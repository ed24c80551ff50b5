// Draws the frames of videos in several processes and delivers them in order. The resulting video does not
// depend on the number of processes.
//
// It uses processes instead of threads, because Mesa draws only one image at a time per process. They are
// forked after this process has drawn the first frame, so that the scene, the OpenGL context and its compiled
// shaders are created only once.
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

// Holds one renderer per scene. If a task randomizes colors, lights or cameras, the renderer is set to the
// appearance of the requested episode.
class VideoScenes {
 public:
  // are_outlined: whether the task's objects have outlines.
  explicit VideoScenes(FrameSize largest, bool are_outlined = false)
      : largest_(largest), are_outlined_(are_outlined) {}

  // Returns the renderer for an episode of a log. seed: the episode's seed, if it is known. Throws the errors
  // of VisualModel() and Renderer::SetAppearance().
  Renderer* Of(const model_info_t& model, const std::filesystem::path& log, std::optional<int64_t> seed);
  // Frees the renderers that have not been requested since the last call of FreeUnused.
  void FreeUnused();

 private:
  struct Scene {
    std::unique_ptr<Renderer> renderer;
    bool varies = false, is_used = false;
    std::optional<int64_t> seed;
  };
  FrameSize largest_;
  bool are_outlined_;
  // Scenes by key. The key consists of the SHA-256 of the visual model, the variation and the task.
  std::map<std::string, Scene> scenes_;
};

// Must be constructed, used and destroyed in the same thread.
class ParallelFrameRenderer {
 public:
  // Returns frame n of each video that is being made. The number and the sizes of these frames must not
  // depend on n.
  using DrawFrames = std::function<std::vector<Frame>(size_t n)>;
  // Called by Render() once; returns the function that draws the frames of its videos.
  using Begin = std::function<DrawFrames(VideoScenes*)>;

  // largest: maximum size of the images. processes: 0 selects the number of cores, at most 8. With EGL, a
  // single process draws in any case. are_outlined: whether the task's objects have outlines.
  explicit ParallelFrameRenderer(FrameSize largest, size_t processes = 0, bool are_outlined = false);

  FrameSize largest() const { return largest_; }
  // Calls `take` in this process for frames 0 to num_frames - 1 in order, while later frames are being drawn.
  // Throws the exceptions of the drawing function (types other than InputError and EnvironmentError become
  // std::runtime_error). Throws EnvironmentError if a process dies or this process is asked to stop.
  void Render(size_t num_frames, const Begin& begin,
              const std::function<void(size_t n, const std::vector<Frame>&)>& take);

 private:
  FrameSize largest_;
  size_t processes_;
  VideoScenes scenes_;
};

}  // namespace evalbus::viz
