#include "cli/launch/filming.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/host.h"
#include "bus/recorder/recorder.h"
#include "viz/pictures/film.h"

namespace evalbus::launch {

namespace {

// `evalbus render`, with what processor time others leave.
Filming::Render Niced(const std::filesystem::path& run, const std::vector<std::string>& cameras) {
  return [=](int episode) -> std::vector<std::string> {
    return {"/usr/bin/nice",
            "-n",
            "19",
            (Processes::BinaryFolder() / "evalbus").string(),
            "render",
            run.string(),
            "--episode",
            std::to_string(episode),
            "--camera",
            fmt::format("{}", fmt::join(cameras, ","))};
  };
}

}  // namespace

Filming::Filming(const results::RunFolder& folder, const std::vector<std::string>& cameras, RunListener* next)
    : Filming(folder, cameras, next, Niced(folder.path(), cameras)) {}

Filming::Filming(const results::RunFolder& folder, std::vector<std::string> cameras, RunListener* next,
                 Render render)
    : folder_(folder), cameras_(std::move(cameras)), next_(next), render_(std::move(render)) {}

Filming::~Filming() {
  if (processes_.StopAll().empty()) return;
  folder_.RemoveFiles(kUnfinishedFilmEnding);
}

void Filming::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  const int index = episode["episode"].get<int>();
  const bool is_missing = std::ranges::any_of(cameras_, [&](const std::string& camera) {
    return !std::filesystem::exists(EpisodeFolder(folder_.path(), index) / viz::FilmName(camera));
  });
  if (is_missing && failure_.empty()) waiting_.push_back(index);
  next_->OnEpisodeDone(episode);
}

void Filming::Poll(SteadyTime now) {
  Advance();
  next_->Poll(now);
}

size_t Filming::Finish() {
  Advance();
  if (Missing() > 0 && !stop_requested()) {
    fmt::print("filming {} more episode{}\n", Missing(), Missing() == 1 ? "" : "s");
    std::fflush(stdout);
  }
  while (filming_ && !stop_requested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    Advance();
  }
  if (!failure_.empty()) throw EnvironmentError("no film: " + failure_);
  return Missing();
}

void Filming::Advance() {
  if (const auto exit = processes_.Poll()) {
    const int episode = *std::exchange(filming_, std::nullopt);
    if (exit->code > 1 && tried_again_.insert(episode).second) {
      waiting_.push_front(episode);
    } else if (exit->code != 0) {
      failure_ = exit->Error();
      waiting_.clear();
    }
  }
  if (filming_ || waiting_.empty()) return;
  processes_.Start("film", render_(waiting_.front()), folder_.log_file("film"));
  filming_ = waiting_.front();
  waiting_.pop_front();
}

}  // namespace evalbus::launch
