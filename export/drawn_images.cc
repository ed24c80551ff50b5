#include "export/drawn_images.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <list>
#include <memory>
#include <thread>

#include "base/errors.h"
#include "base/forked_work.h"
#include "base/input_file.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "export/training_set.h"
#include "models/physics_model.h"
#include "results/episode_logs.h"
#include "viz/images/renderer.h"
#include "viz/viewer/page_files.h"

namespace evalbus::exports {
namespace {

namespace fs = std::filesystem;

// Higher levels reduce the size of these images only slightly.
constexpr int kDeflateLevel = 1;
constexpr auto kLookedEvery = std::chrono::milliseconds(50);

// Loads the model from the log's own run folder, which may have been moved since the log was recorded.
ModelPtr ModelOf(model_info_t model, const fs::path& log) {
  const fs::path own = RunFolderOf(log) / kModelFolder / kVisualModel;
  if (fs::exists(own)) model.visual_file = own.string();
  return LoadVisualModel(model);
}

}  // namespace

DrawnImages::DrawnImages(std::vector<fs::path> logs, ImageOptions options, fs::path folder)
    : logs_(std::move(logs)), options_(std::move(options)), folder_(std::move(folder)) {
  for (const fs::path& log : logs_) {
    const std::string depends_on =
        fmt::format("{} {} {}x{}", Sha256File(log), options_.cameras, options_.width, options_.height);
    files_.push_back(folder_ / Sha256Text(depends_on).substr(0, 32));
  }
}

// Renders all episodes that are assigned to one worker process, one at a time.
class DrawnImages::Painter {
 public:
  explicit Painter(const ImageOptions& options) : options_(options) {}

  // `is_wanted` is called after each state; if it returns false, no file is written.
  void Draw(const fs::path& log, const fs::path& file, const std::function<bool()>& is_wanted);

 private:
  const ImageOptions& options_;
  std::unique_ptr<viz::Renderer> renderer_;
  // Hash of the model that renderer_ was created for.
  std::string model_sha256_;
};

void DrawnImages::Painter::Draw(const fs::path& log, const fs::path& file,
                                const std::function<bool()>& is_wanted) {
  const EpisodeSteps episode = ReadSteps(log);
  if (!renderer_ || model_sha256_ != episode.model.visual_sha256) {
    renderer_ = std::make_unique<viz::Renderer>(ModelOf(episode.model, log), viz::FrameSize{64, 64});
    model_sha256_ = episode.model.visual_sha256;
  }
  viz::Renderer& renderer = *renderer_;
  renderer.SetAppearance(episode.model, episode.begin.seed);
  std::string text;
  std::vector<uint8_t> rgb;
  for (const state_t& state : episode.states) {
    renderer.SetState(state);
    for (const std::string& camera : options_.cameras) {
      renderer.RenderRgb(
          {.camera = viz::FindCamera(renderer.model(), camera), .size = {options_.width, options_.height}},
          &rgb);
      const std::string deflated =
          viz::Deflated({reinterpret_cast<const char*>(rgb.data()), rgb.size()}, kDeflateLevel);
      const auto length = static_cast<uint32_t>(deflated.size());
      text.append(reinterpret_cast<const char*>(&length), sizeof length);
      text += deflated;
    }
    if (!is_wanted()) return;
  }
  WriteWhole(file, text);
}

void DrawnImages::Draw(const std::function<void(double)>& progress) {
  std::vector<size_t> missing;
  size_t total = 0;
  size_t drawn = 0;
  for (size_t i = 0; i < logs_.size(); ++i) {
    const EpisodeSteps episode = ReadSteps(logs_[i]);
    if (i == 0) {
      const ModelPtr model = ModelOf(episode.model, logs_[i]);
      for (const std::string& camera : options_.cameras) viz::FindCamera(*model, camera);
    }
    total += episode.states.size();
    if (fs::exists(files_[i])) {
      drawn += episode.states.size();
    } else {
      missing.push_back(i);
    }
  }
  if (missing.empty()) return;
  fs::create_directories(folder_);

  // Renders in processes instead of threads, because Mesa renders only one image at a time per process.
  struct Shared {
    std::atomic<size_t> next, drawn;
    std::atomic<bool> is_over;
  };
  const SharedMemory memory(sizeof(Shared));
  Shared& shared = *new (memory.get()) Shared{0, drawn, false};
  const auto draw = [&] {
    Painter painter(options_);
    const auto is_wanted = [&] { return !shared.is_over && !stop_requested(); };
    while (is_wanted()) {
      const size_t taken = shared.next++;
      if (taken >= missing.size()) break;
      painter.Draw(logs_[missing[taken]], files_[missing[taken]], [&] {
        ++shared.drawn;
        return is_wanted();
      });
    }
  };
  std::list<ForkedWork> processes;
  const size_t count = std::min(missing.size(), size_t{std::max(1u, std::thread::hardware_concurrency())});
  while (processes.size() < count) processes.emplace_back("a rendering process", draw);
  std::exception_ptr error;
  while (!processes.empty()) {
    std::this_thread::sleep_for(kLookedEvery);
    if (stop_requested()) shared.is_over = true;
    progress(static_cast<double>(shared.drawn) / static_cast<double>(total));
    std::erase_if(processes, [&](ForkedWork& process) {
      if (!process.HasEnded()) return false;
      try {
        process.CheckEnd();
      } catch (...) {
        if (!error) error = std::current_exception();
        shared.is_over = true;
      }
      return true;
    });
  }
  if (error) std::rethrow_exception(error);
  if (stop_requested()) {
    const auto there = std::ranges::count_if(files_, [](const fs::path& file) { return fs::exists(file); });
    throw EnvironmentError(fmt::format(
        "stopped; the images of {} of {} episodes are in {}; run the same command again to continue", there,
        files_.size(), folder_.string()));
  }
}

std::vector<std::string> DrawnImages::Of(size_t i) const {
  const std::string text = ReadInput(files_[i]);
  std::vector<std::string> images;
  for (size_t at = 0; at < text.size();) {
    uint32_t length = 0;
    if (text.size() - at >= sizeof length) std::memcpy(&length, text.data() + at, sizeof length);
    at += sizeof length;
    if (length == 0 || at > text.size() || length > text.size() - at) {
      throw InputError(files_[i].string() + ": damaged; delete it to have it rendered again");
    }
    images.push_back(text.substr(at, length));
    at += length;
  }
  return images;
}

void DrawnImages::RemoveAll() const {
  std::error_code ignored;
  for (const fs::path& file : files_) fs::remove(file, ignored);
  // Keeps the folder if it still contains other images, because removing it then fails.
  fs::remove(folder_, ignored);
}

}  // namespace evalbus::exports
