#include "runner/video_recording.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string_view>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "runner/video_progress.h"
#include "viz/images/video.h"

namespace evalbus::runner {

namespace {

VideoRecording::Render Rendering(const std::filesystem::path& run, const std::vector<std::string>& cameras,
                                 const std::string& gl) {
  return [=](int episode) -> std::vector<std::string> {
    return {(Processes::BinaryFolder() / "evalbus").string(),
            "render",
            run.string(),
            "--episode",
            std::to_string(episode),
            "--camera",
            fmt::format("{}", fmt::join(cameras, ",")),
            "--gl",
            gl,
            "--report-progress"};
  };
}

}  // namespace

VideoRecording::VideoRecording(const results::RunFolder& folder, const std::vector<std::string>& cameras,
                               const std::string& gl, RunListener* next)
    : VideoRecording(folder, cameras, next, Rendering(folder.path(), cameras, gl)) {}

VideoRecording::VideoRecording(const results::RunFolder& folder, std::vector<std::string> cameras,
                               RunListener* next, Render render)
    : folder_(folder),
      cameras_(std::move(cameras)),
      next_(next),
      render_(std::move(render)),
      log_(folder.log_file("video")) {
  log_.Next();  // skips the lines of an earlier run in this folder
}

VideoRecording::~VideoRecording() {
  for (const Processes::Exit& exit : processes_.StopAll()) RemoveUnfinished(exit.pid);
}

void VideoRecording::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  const int index = episode["episode"].get<int>();
  const bool is_missing = std::ranges::any_of(cameras_, [&](const std::string& camera) {
    return !std::filesystem::exists(EpisodeFolder(folder_.path(), index) / viz::VideoName(camera));
  });
  if (is_missing && !gave_up_) waiting_.push_back(index);
  next_->OnEpisodeDone(episode);
}

void VideoRecording::Poll(SteadyTime now) {
  Advance();
  next_->Poll(now);
}

double VideoRecording::Left() {
  const std::string_view mark = kVideoShare;
  for (const std::string& line : log_.Next()) {
    if (line.starts_with(mark)) share_ = std::atof(line.c_str() + mark.size());
  }
  return static_cast<double>(Missing()) - (rendering_ ? share_ : 0);
}

size_t VideoRecording::Finish() {
  using std::chrono::steady_clock;
  constexpr auto kRedrawPeriod = std::chrono::milliseconds(200);
  const bool is_terminal = isatty(STDOUT_FILENO) != 0;
  is_beside_run_ = false;
  Advance();
  const size_t total = Missing();
  const auto done = [&] { return static_cast<double>(total) - Left(); };
  const VideoProgress progress(total, done(), steady_clock::now());
  steady_clock::time_point drawn{};
  // If there is no terminal, prints a line for each episode.
  for (size_t shown = total + 1; rendering_ && !stop_requested();) {
    const auto now = steady_clock::now();
    if (is_terminal && now - drawn > kRedrawPeriod) {
      fmt::print("\x1b[K{}\r", progress.Text(done(), now));
      drawn = now;
    } else if (!is_terminal && Missing() < shown) {
      fmt::print("{}\n", progress.Text(done(), now));
      shown = Missing();
    }
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    // The nice value is set repeatedly, because a process lowers its own priority only some time after its
    // start.
    processes_.SetNice(getpriority(PRIO_PROCESS, 0));
    Advance();
  }
  if (is_terminal) fmt::print("\x1b[K");
  if (!failure_.empty()) throw EnvironmentError("no video: " + failure_);
  return Missing();
}

// Removes only files of the process `video`, because another process may be recording the same episode.
void VideoRecording::RemoveUnfinished(pid_t video) const { folder_.RemoveHalfWrittenVideos(video); }

void VideoRecording::Advance() {
  if (const auto exit = processes_.Poll()) {
    const int episode = *std::exchange(rendering_, std::nullopt);
    RemoveUnfinished(exit->pid);
    if (exit->code > 1 && tried_again_.insert(episode).second) {
      waiting_.push_front(episode);
    } else if (exit->code != 0) {
      if (failure_.empty()) failure_ = exit->Error();
      // Exit code 1 means that the episode's log is invalid; other logs may be valid.
      gave_up_ = exit->code != 1;
      if (gave_up_) waiting_.clear();
    }
  }
  if (rendering_ || waiting_.empty()) return;
  std::vector<std::string> command = render_(waiting_.front());
  // Runs at the lowest priority, so that it slows down the evaluation as little as possible.
  if (is_beside_run_) command.insert(command.begin(), {"/usr/bin/nice", "-n", "19"});
  processes_.Start("video", command, folder_.log_file("video"));
  rendering_ = waiting_.front();
  Left();  // discards the progress of the previous video
  share_ = 0;
  waiting_.pop_front();
}

}  // namespace evalbus::runner
