#include "cli/run_controller.h"

#include <cmath>

#include "bus/channels.h"
#include "bus/errors.h"
#include "metrics/result_json.h"
#include "sim/episode_seed.h"

namespace evalbus {
namespace {

constexpr auto kRepeatCommand = std::chrono::milliseconds(500);
constexpr auto kRecorderTimeout = std::chrono::seconds(10);
// STATUS comes at least every 400 ms from a component that lives.
constexpr auto kSilence = std::chrono::seconds(10);
// Loading models and programs takes longer, on a machine that has much else to do.
constexpr auto kStartSilence = std::chrono::seconds(60);
// If we ourselves were held up for longer, the others' messages wait unread.
constexpr auto kOwnGap = std::chrono::seconds(1);

}  // namespace

RunController::RunController(Bus* bus, const RunPlan& plan, const RunFolder& folder, RunListener* listener)
    : Component(bus, "run"), plan_(plan), folder_(folder), listener_(listener) {
  bus->Subscribe<episode_begin_t>(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
    if (done() || begin.header.episode != episode_index() || begin.attempt != attempt_) return;
    if (EnterEpisode(begin)) {
      begun_ = true;
      SayReady();
      listener_->OnEpisodeBegin(begin);
    }
  });
  bus->Subscribe<partial_metrics_t>(channels::kPartial, [this](const partial_metrics_t& partial) {
    if (begun_ && IsOurs(partial.header)) listener_->OnPartial(partial);
  });
  bus->Subscribe<episode_summary_t>(channels::kEpisodeSummary,
                                    [this](const episode_summary_t& summary) { OnSummary(summary); });
  bus->Subscribe<component_status_t>(channels::kStatus, [this](const component_status_t& status) {
    if (silent_at_.contains(status.component)) {
      silent_at_[status.component] = std::chrono::steady_clock::now() + kSilence;
    }
    if (!done() && status.component == "recorder" && status.attempt == attempt_ &&
        status.last_finished_episode == episode_index()) {
      recorded_ = true;
      FinishIfRecorded();
    }
  });
}

void RunController::Command() {
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = episode_index();
  command.attempt = attempt_;
  command.seed = EpisodeSeed(plan_.seed, episode_index());
  command.required_component = plan_.required;
  command.num_required = static_cast<int32_t>(plan_.required.size());
  bus().Publish(channels::kCommand, command);
  commanded_ = std::chrono::steady_clock::now();
}

void RunController::Poll(SteadyTime now) {
  Component::Poll(now);
  if (done()) return;
  if (!begun_ && now - commanded_ >= kRepeatCommand) Command();
  if (episode_ && now - summarised_ > kRecorderTimeout) {
    throw EnvironmentError("the recorder did not finish the log of episode " +
                           std::to_string(episode_index()) +
                           " (its log: " + folder_.log_file("recorder").string() + ")");
  }
}

void RunController::ExpectStart() {
  const auto now = std::chrono::steady_clock::now();
  silent_at_["sim"] = now + kStartSilence;
  for (const std::string& name : plan_.required) silent_at_[name] = now + kStartSilence;
}

std::string RunController::Silent(SteadyTime now) {
  const auto gap = now - listened_;
  if (listened_ != SteadyTime{} && gap > kOwnGap) {
    for (auto& [name, at] : silent_at_) at += gap;
  }
  listened_ = now;
  for (const auto& [name, at] : silent_at_) {
    if (now >= at) return name;
  }
  return "";
}

void RunController::OnSummary(const episode_summary_t& summary) {
  if (done() || summary.header.episode != episode_index() || summary.attempt != attempt_ || episode_) return;
  if (summary.end_reason == "aborted") return BeginAgain(summary.end_detail);
  episode_ = summary;
  summarised_ = std::chrono::steady_clock::now();
  FinishIfRecorded();
}

void RunController::FinishIfRecorded() {
  if (!episode_ || !recorded_) return;
  const nlohmann::ordered_json line = EpisodeJson(plan_.task, plan_.variation, *episode_);
  folder_.AddEpisode(episode_index(), line);
  listener_->OnEpisodeDone(line);
  episode_.reset();
  begun_ = recorded_ = false;
  attempt_ = 0;
  ++next_;
  if (!done()) Command();
}

void RunController::Retry(const std::string& why) {
  BeginAgain(why);
  folder_.DiscardEpisode(episode_index());
}

// Leaves the folder to the recorder, which may be about to close the log of the attempt that was aborted.
void RunController::BeginAgain(const std::string& why) {
  if (attempt_ + 1 >= plan_.max_attempts) {
    throw EnvironmentError("episode " + std::to_string(episode_index()) + " failed " +
                           std::to_string(plan_.max_attempts) + " times, the last time: " + why);
  }
  listener_->OnRetry(episode_index(), why);
  episode_.reset();
  begun_ = recorded_ = false;
  ++attempt_;
}

nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary) {
  return {{"task", task},
          {"variation", variation},
          {"episode", summary.header.episode},
          {"seed", summary.seed},
          {"end_reason", summary.end_reason},
          {"end_detail", summary.end_detail},
          {"failure_reason", summary.failure_reason},
          {"complete", summary.complete != 0},
          {"metrics", ResultJson(summary.metrics)},
          {"extended", ExtendedJson(summary.extended, summary.metrics)},
          {"explanation", ExplanationJson(summary.explanation)}};
}

}  // namespace evalbus
