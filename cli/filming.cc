#include "cli/filming.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <thread>

#include "bus/component.h"
#include "bus/errors.h"

namespace evalbus {

Filming::Filming(const RunFolder& folder, std::vector<std::string> cameras, RunListener* next)
    : folder_(folder), cameras_(std::move(cameras)), next_(next) {}

void Filming::OnEpisodeDone(const nlohmann::ordered_json& episode) {
  if (!cameras_.empty() && failure_.empty()) waiting_.push_back(episode["episode"].get<int>());
  next_->OnEpisodeDone(episode);
}

void Filming::Poll(SteadyTime now) {
  Advance();
  next_->Poll(now);
}

void Filming::Finish() {
  Advance();
  const size_t left = waiting_.size() + filming_;
  if (left > 0) {
    fmt::print("filming {} more episode{}\n", left, left == 1 ? "" : "s");
    std::fflush(stdout);
  }
  while (filming_ && !stop_requested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    Advance();
  }
  if (!failure_.empty()) throw EnvironmentError("no film: " + failure_);
}

void Filming::Advance() {
  if (const auto exit = processes_.Poll()) {
    filming_ = false;
    if (exit->code != 0) {
      failure_ = exit->Error();
      waiting_.clear();
    }
  }
  if (filming_ || waiting_.empty()) return;
  const std::string program = (Processes::BinaryFolder() / "evalbus").string();
  processes_.Start(
      "film",
      {"/usr/bin/nice", "-n", "19", program, "render", folder_.path().string(), "--episode",
       std::to_string(waiting_.front()), "--camera", fmt::format("{}", fmt::join(cameras_, ","))},
      folder_.log_file("film"));
  waiting_.pop_front();
  filming_ = true;
}

}  // namespace evalbus
