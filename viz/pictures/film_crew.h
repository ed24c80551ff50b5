// Draws the frames of films on several threads, each with renderers of its own, and hands them over in their
// order: a film is the same whatever the number of threads.
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
#include "viz/pictures/renderer.h"

namespace evalbus::viz {

// A renderer for each scene. Where a task draws colours, lights or cameras, each episode has its own. Used by
// one thread.
class FilmScenes {
 public:
  explicit FilmScenes(FrameSize largest) : largest_(largest) {}

  // Of an episode in a log, with its seed if that is known. Throws InputError as VisualModel and
  // Renderer::SetAppearance.
  Renderer* Of(const model_info_t& model, const std::filesystem::path& log, std::optional<int64_t> seed);

 private:
  struct Scene {
    std::unique_ptr<Renderer> renderer;
    bool varies = false;
    std::optional<int64_t> seed;
  };
  FrameSize largest_;
  // By the visual model's SHA-256, the variation and the task.
  std::map<std::string, Scene> scenes_;
};

class FilmCrew {
 public:
  // Frame n, of each film that is made at once.
  using DrawFrames = std::function<std::vector<Frame>(size_t n)>;
  // Called in each thread that draws, before its first frame.
  using Begin = std::function<DrawFrames(FilmScenes*)>;

  // Frames are no larger than this. threads: as many as there are cores, but not more than 8, unless said.
  explicit FilmCrew(FrameSize largest, size_t threads = 0);
  ~FilmCrew();
  FilmCrew(const FilmCrew&) = delete;
  FilmCrew& operator=(const FilmCrew&) = delete;

  // Calls take for frames 0 to num_frames - 1, in this thread, while later ones are drawn. Throws what
  // drawing throws, and EnvironmentError where the process is asked to stop.
  void Film(size_t num_frames, const Begin& begin,
            const std::function<void(size_t n, const std::vector<Frame>&)>& take);

 private:
  struct Thread;
  std::vector<std::unique_ptr<Thread>> threads_;
};

}  // namespace evalbus::viz
