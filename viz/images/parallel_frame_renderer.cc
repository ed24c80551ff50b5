#include "viz/images/parallel_frame_renderer.h"

#include <semaphore.h>
#include <time.h>

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "base/errors.h"
#include "base/forked_work.h"
#include "bus/host.h"
#include "models/task_description.h"
#include "viz/images/log_episodes.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::viz {
namespace {

// More processes are not faster, because encoding by ffmpeg becomes the bottleneck.
constexpr size_t kMaxProcesses = 8;
// Number of frames that a process may draw ahead, so that a slow frame in one process does not stall the
// other processes.
constexpr size_t kAhead = 4;
// Interval between checks that a process is still alive, ns.
constexpr int64_t kLookNs = 100000000;

void CheckStop() {
  if (stop_requested()) throw EnvironmentError("stopped; the unfinished video is not kept");
}

// A child process that draws every `step`-th frame of a video. It inherits a copy of all objects of this
// process.
class Drawer {
 public:
  // Draws the frames first, first + step, and so on. The frames drawn in one step have the sizes of the
  // frames in `like`.
  Drawer(size_t first, size_t step, size_t num_frames, const ParallelFrameRenderer::DrawFrames& draw,
         const std::vector<Frame>& like)
      : bytes_(BytesOf(like)), memory_(sizeof(Shared) + kAhead * bytes_), shared_(Init(memory_.get())) {
    work_.emplace("a rendering process", [&] { Work(first, step, num_frames, draw); });
  }

  // Waits for the next frames and copies them to `frames`.
  void Take(std::vector<Frame>* frames);

 private:
  struct Shared {
    sem_t room, drawn;
  };

  static size_t BytesOf(const std::vector<Frame>& frames) {
    size_t bytes = 0;
    for (const Frame& frame : frames) bytes += frame.bgrx.size();
    return bytes;
  }
  static Shared* Init(void* memory) {
    Shared* const shared = new (memory) Shared{};
    sem_init(&shared->room, 1, kAhead);
    sem_init(&shared->drawn, 1, 0);
    return shared;
  }
  uint8_t* Place(size_t taken_or_drawn) const {
    return static_cast<uint8_t*>(memory_.get()) + sizeof(Shared) + taken_or_drawn % kAhead * bytes_;
  }
  void Work(size_t first, size_t step, size_t num_frames,
            const ParallelFrameRenderer::DrawFrames& draw) const;
  // Waits for a frame, at most until the next check of the process. Returns whether a frame was drawn.
  bool WaitForFrame() const;

  const size_t bytes_;
  const SharedMemory memory_;
  Shared* const shared_;
  size_t taken_ = 0;
  std::optional<ForkedWork> work_;
};

void Drawer::Work(size_t first, size_t step, size_t num_frames,
                  const ParallelFrameRenderer::DrawFrames& draw) const {
  size_t drawn = 0;
  for (size_t n = first; n < num_frames; n += step) {
    // Retries if a signal interrupts the wait. If the program is asked to stop, the parent process kills this
    // process.
    while (sem_wait(&shared_->room) != 0) {
    }
    const std::vector<Frame> frames = draw(n);
    if (BytesOf(frames) != bytes_) throw std::logic_error("the frames of a video differ in size");
    uint8_t* place = Place(drawn++);
    for (const Frame& frame : frames) place = std::copy(frame.bgrx.begin(), frame.bgrx.end(), place);
    sem_post(&shared_->drawn);
  }
}

bool Drawer::WaitForFrame() const {
  timespec until;
  clock_gettime(CLOCK_MONOTONIC, &until);
  until.tv_nsec += kLookNs;
  if (until.tv_nsec >= 1000000000) {
    until.tv_nsec -= 1000000000;
    ++until.tv_sec;
  }
  return sem_clockwait(&shared_->drawn, CLOCK_MONOTONIC, &until) == 0;
}

void Drawer::Take(std::vector<Frame>* frames) {
  while (!WaitForFrame()) {
    CheckStop();
    if (!work_->HasEnded()) continue;
    if (sem_trywait(&shared_->drawn) == 0) break;
    work_->CheckEnd();
    throw std::logic_error("a rendering process skipped frames");
  }
  const uint8_t* place = Place(taken_++);
  for (Frame& frame : *frames) {
    std::copy_n(place, frame.bgrx.size(), frame.bgrx.begin());
    place += frame.bgrx.size();
  }
  sem_post(&shared_->room);
}

// Returns for each body id whether the body belongs to one of the task's objects.
std::vector<bool> ObjectBodies(const model_info_t& model) {
  std::vector<bool> is_object;
  for (const int32_t entity : model.body_entity) {
    is_object.push_back(std::ranges::find(model.object_entity, entity) != model.object_entity.end());
  }
  return is_object;
}

}  // namespace

Renderer* VideoScenes::Of(const model_info_t& model, const std::filesystem::path& log,
                          std::optional<int64_t> seed) {
  Scene& scene = scenes_[model.visual_sha256 + model.variation + model.task_yaml];
  scene.is_used = true;
  if (!scene.renderer) {
    scene.renderer = std::make_unique<Renderer>(VisualModel(model, log), largest_, Look::kVideo,
                                                are_outlined_ ? ObjectBodies(model) : std::vector<bool>());
    const TaskDescription task = ParseTask(model.task_yaml, model.task_file, false);
    scene.varies = !task.variation(model.variation).appearance.empty();
  }
  if (scene.varies && scene.seed != seed) {
    scene.renderer->SetAppearance(model, seed);
    scene.seed = seed;
  }
  return scene.renderer.get();
}

void VideoScenes::FreeUnused() {
  std::erase_if(scenes_, [](const auto& entry) { return !entry.second.is_used; });
  for (auto& [key, scene] : scenes_) scene.is_used = false;
}

ParallelFrameRenderer::ParallelFrameRenderer(FrameSize largest, size_t processes, bool are_outlined)
    : largest_(largest), processes_(processes), scenes_(largest, are_outlined) {
  if (processes_ == 0) {
    processes_ = std::clamp<size_t>(std::thread::hardware_concurrency(), 1, kMaxProcesses);
  }
  if (!IsGlInMemory()) processes_ = 1;
}

void ParallelFrameRenderer::Render(size_t num_frames, const Begin& begin,
                                   const std::function<void(size_t n, const std::vector<Frame>&)>& take) {
  if (num_frames == 0) return;
  CheckStop();
  const DrawFrames draw = begin(&scenes_);
  scenes_.FreeUnused();
  std::vector<Frame> frames = draw(0);
  std::vector<std::unique_ptr<Drawer>> drawers;
  const size_t count = processes_ > 1 ? std::min(processes_, num_frames - 1) : 0;
  while (drawers.size() < count) {
    drawers.push_back(std::make_unique<Drawer>(1 + drawers.size(), count, num_frames, draw, frames));
  }
  take(0, frames);
  for (size_t n = 1; n < num_frames; ++n) {
    CheckStop();
    if (drawers.empty()) {
      frames = draw(n);
    } else {
      drawers[(n - 1) % count]->Take(&frames);
    }
    take(n, frames);
  }
}

}  // namespace evalbus::viz
