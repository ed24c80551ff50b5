#include "viz/pictures/film_crew.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <deque>
#include <future>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "bus/host.h"
#include "models/task_description.h"
#include "viz/pictures/recorded_episode.h"

namespace evalbus::viz {
namespace {

// ffmpeg encodes no faster than so many draw.
constexpr size_t kMostThreads = 8;

}  // namespace

Renderer* FilmScenes::Of(const model_info_t& model, const std::filesystem::path& log,
                         std::optional<int64_t> seed) {
  Scene& scene = scenes_[model.visual_sha256 + model.variation + model.task_yaml];
  if (!scene.renderer) {
    scene.renderer = std::make_unique<Renderer>(VisualModel(model, log), largest_);
    const TaskDescription task = ParseTask(model.task_yaml, model.task_file, false);
    scene.varies = !task.variation(model.variation).appearance.empty();
  }
  if (scene.varies && scene.seed != seed) {
    scene.renderer->SetAppearance(model, seed);
    scene.seed = seed;
  }
  return scene.renderer.get();
}

// OpenGL's contexts are made, used and freed in one thread.
struct FilmCrew::Thread {
  explicit Thread(FrameSize largest) : scenes(std::make_unique<FilmScenes>(largest)) {}
  template <class F>
  auto Do(F f) {
    std::packaged_task<decltype(f())()> task(std::move(f));
    auto done = task.get_future();
    boost::asio::post(thread, std::move(task));
    return done;
  }
  ~Thread() {
    Do([this] { scenes.reset(); }).wait();
  }

  std::unique_ptr<FilmScenes> scenes;
  DrawFrames draw;
  boost::asio::thread_pool thread{1};
};

FilmCrew::FilmCrew(FrameSize largest, size_t threads) {
  if (threads == 0) threads = std::clamp<size_t>(std::thread::hardware_concurrency(), 1, kMostThreads);
  while (threads_.size() < threads) threads_.push_back(std::make_unique<Thread>(largest));
}

FilmCrew::~FilmCrew() = default;

void FilmCrew::Film(size_t num_frames, const Begin& begin,
                    const std::function<void(size_t n, const std::vector<Frame>&)>& take) {
  std::deque<std::future<std::vector<Frame>>> ahead;
  const auto draw = [&](size_t n) {
    if (n >= num_frames) return;
    Thread& thread = *threads_[n % threads_.size()];
    ahead.push_back(thread.Do([&begin, &thread, n] {
      if (stop_requested()) throw EnvironmentError("stopped; no film is half-written");
      if (!thread.draw) thread.draw = begin(thread.scenes.get());
      return thread.draw(n);
    }));
  };
  // However it ends, nothing of this film is drawn any more.
  const auto finish = [this](void*) {
    for (const auto& thread : threads_) thread->Do([&thread] { thread->draw = nullptr; }).wait();
  };
  const std::unique_ptr<void, decltype(finish)> finished(this, finish);
  for (size_t n = 0; n < threads_.size(); ++n) draw(n);
  for (size_t n = 0; n < num_frames; ++n) {
    const std::vector<Frame> frames = ahead.front().get();
    ahead.pop_front();
    draw(n + threads_.size());
    take(n, frames);
  }
}

}  // namespace evalbus::viz
