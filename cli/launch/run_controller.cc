#include "cli/launch/run_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "cli/results/episode_json.h"
#include "cli/results/pacing.h"
#include "lcmtypes/end_reason.h"

namespace evalbus::launch {
namespace {

constexpr auto kRepeatCommand = std::chrono::milliseconds(500);
constexpr auto kRecorderTimeout = std::chrono::seconds(10);
constexpr auto kSummaryTimeout = std::chrono::seconds(10);
// STATUS comes at least every 400 ms from a component that lives.
constexpr auto kSilence = std::chrono::seconds(10);
// Loading models and programs takes longer, on a machine that has much else to do.
constexpr auto kStartSilence = std::chrono::seconds(60);
// If we ourselves were held up for longer, the others' messages wait unread.
constexpr auto kOwnGap = std::chrono::seconds(1);

// A component whose log is on a full disk cannot say so there.
std::string WhyNoSpace(const std::filesystem::path& folder) {
  constexpr uintmax_t kAlmostNone = 64 << 10;
  std::error_code error;
  const auto space = std::filesystem::space(folder, error);
  if (error || space.available > kAlmostNone) return "";
  return "; no space left on the disk of " + folder.string();
}

}  // namespace

RunController::RunController(Bus* bus, const RunPlan& plan, const results::RunFolder& folder,
                             RunListener* listener)
    : Component(bus, "run"), plan_(plan), folder_(folder), listener_(listener) {
  bus->Subscribe<episode_begin_t>(channels::kEpisodeBegin,
                                  [this](const episode_begin_t& begin) { OnBegin(begin); });
  bus->Subscribe<partial_metrics_t>(channels::kPartial, [this](const partial_metrics_t& partial) {
    if (!begun_ || !IsOurs(partial.header)) return;
    started_ = true;
    listener_->OnPartial(partial);
  });
  // Another sim may have answered the COMMAND; the models of ours are in the run's folder.
  const auto own_model =
      std::filesystem::absolute(folder.path() / kModelFolder / kPhysicsModel).lexically_normal();
  bus->Subscribe<model_info_t>(channels::kModel, [this, own_model](const model_info_t& model) {
    if (model.physics_file == own_model) {
      own_model_heard_ = true;
      if (early_begin_) OnBegin(*std::exchange(early_begin_, std::nullopt));
    } else {
      foreign_model_ = model.physics_file;
    }
  });
  bus->Subscribe<episode_end_t>(channels::kEpisodeEnd, [this](const episode_end_t& end) { OnEnd(end); });
  bus->Subscribe<episode_summary_t>(channels::kEpisodeSummary,
                                    [this](const episode_summary_t& summary) { OnSummary(summary); });
  bus->Subscribe<component_status_t>(channels::kStatus,
                                     [this](const component_status_t& status) { OnStatus(status); });
}

void RunController::OnBegin(const episode_begin_t& begin) {
  if (done() || begin.header.episode != episode_index() || begin.attempt != attempt_ ||
      begin.seed != seed()) {
    return;
  }
  // Before our sim has said anything, this may be an old log of the same seed.
  if (!own_model_heard_) {
    early_begin_ = begin;
    return;
  }
  if (EnterEpisode(begin)) {
    conflicts_.Start();
    ended_.reset();
    begun_ = true;
    SayReady();
    listener_->OnEpisodeBegin(begin);
  }
}

void RunController::OnStatus(const component_status_t& status) {
  const bool is_guest = plan_.policy_is_external && status.component == "policy";
  if (is_guest || silent_at_.contains(status.component)) {
    silent_at_[status.component] = std::chrono::steady_clock::now() + kSilence;
  }
  if (is_guest && status.state == component_status_t::FAILED) policy_error_ = status.error;
  if (status.component == "sim" ||
      std::ranges::find(plan_.required, status.component) != plan_.required.end()) {
    Dropped& dropped = dropped_[status.component];
    dropped.decode_errors = std::max(dropped.decode_errors, status.decode_errors);
    dropped.foreign_messages = std::max(dropped.foreign_messages, status.foreign_messages);
  }
  if (done() || status.attempt != attempt_ || status.last_finished_episode != episode_index()) return;
  // Its EPISODE_END may have been lost.
  if (status.component == "sim" && begun_ && !ended_) ended_ = std::chrono::steady_clock::now();
  if (status.component == "recorder") {
    if (!ended_)
      return BeginAgain("its log was closed before its end: is an old log being played on this bus?");
    recorded_ = true;
  }
  FinishIfRecorded();
}

void RunController::CheckPolicyComes(SteadyTime now) const {
  if (!plan_.policy_is_external || started_) return;
  if (std::chrono::duration<double>(now - waiting_since_).count() <= plan_.policy_timeout_s) return;
  throw EnvironmentError("no policy said that it is ready for episode " + std::to_string(episode_index()) +
                         " within " + std::to_string(std::lround(plan_.policy_timeout_s)) +
                         " s (--policy-timeout-s)" + (policy_error_.empty() ? "" : ": " + policy_error_));
}

int64_t RunController::seed() const { return EpisodeSeed(plan_.seed, episode_index()); }

void RunController::Command() {
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = episode_index();
  command.attempt = attempt_;
  command.seed = seed();
  command.required_component = plan_.required;
  command.num_required = static_cast<int32_t>(plan_.required.size());
  bus().Publish(channels::kCommand, command);
  commanded_ = std::chrono::steady_clock::now();
}

void RunController::Poll(SteadyTime now) {
  Component::Poll(now);
  if (done()) return;
  if (waiting_since_ == SteadyTime{}) waiting_since_ = now;
  CheckPolicyComes(now);
  if (!begun_ && now - commanded_ >= kRepeatCommand) Command();
  // All live, but the sim or somebody it waits for is in an episode that somebody else began.
  const double start_s =
      std::max(std::chrono::duration<double>(kStartSilence).count(), plan_.policy_timeout_s);
  if (!started_ && std::chrono::duration<double>(now - waiting_since_).count() > start_s) {
    BeginAgain("not everybody was ready for it within " + std::to_string(std::lround(start_s)) +
               " s: does somebody else command on this bus?");
    return;
  }
  // EPISODE_END or EPISODE_SUMMARY was lost, or metrics is in an episode that somebody else began.
  if (ended_ && !episode_ && now - *ended_ > kSummaryTimeout) {
    BeginAgain("no score within 10 s after the episode's end");
    return;
  }
  if (episode_ && ended_ && now - std::max(summarised_, *ended_) > kRecorderTimeout) {
    BeginAgain("the recorder did not finish the episode's log within 10 s");
  }
}

void RunController::ExpectStart() {
  const auto now = std::chrono::steady_clock::now();
  silent_at_["sim"] = now + kStartSilence;
  for (const std::string& name : plan_.required) silent_at_[name] = now + kStartSilence;
  if (plan_.policy_is_external) silent_at_.erase("policy");
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

void RunController::OnEnd(const episode_end_t& end) {
  if (done() || !begun_ || !IsOurs(end.header)) return;
  if (conflicts_.Hear(channels::kEpisodeEnd, 0, bus().handled()) == ConflictDetector::Answer::kConflicting) {
    return BeginAgain(conflicts_.conflict());
  }
  end_ = end;
  ended_ = std::chrono::steady_clock::now();
  // Metrics may not be able to say so, if it was led into another episode.
  if (end.end_reason == end_reason::kAborted) BeginAgain(end.detail);
}

void RunController::OnSummary(const episode_summary_t& summary) {
  if (done() || summary.header.episode != episode_index() || summary.attempt != attempt_ || !begun_) return;
  if (summary.end_reason == end_reason::kAborted) return BeginAgain(summary.end_detail);
  if (summary.seed != seed())
    return BeginAgain("begun with a seed that is not ours: is a second run on this bus?");
  if (!foreign_model_.empty())
    return BeginAgain("a sim or a log of another run is on this bus: " + foreign_model_);
  // One of an old log may come first; ours then differs.
  if (conflicts_.Hear(channels::kEpisodeSummary, 0, bus().handled()) ==
      ConflictDetector::Answer::kConflicting) {
    return BeginAgain(conflicts_.conflict());
  }
  if (episode_) return;
  episode_ = summary;
  summarised_ = std::chrono::steady_clock::now();
  FinishIfRecorded();
}

void RunController::FinishIfRecorded() {
  if (!ended_ || !episode_ || !recorded_) return;
  nlohmann::ordered_json line = results::EpisodeJson(plan_.task, plan_.variation, *episode_);
  if (plan_.realtime) {
    const int64_t misses = episode_->extended.deadline_misses;
    line["pacing"] = end_ ? results::EpisodePacing(*end_, misses) : nlohmann::ordered_json();
  }
  folder_.AddEpisode(episode_index(), line);
  listener_->OnEpisodeDone(line);
  StartAttempt(0);
  ++next_;
  if (!done()) Command();
}

std::string RunController::DroppedMessages() const {
  int64_t undecoded = 0, foreign = 0;
  std::string by;
  for (const auto& [name, dropped] : dropped_) {
    undecoded += dropped.decode_errors;
    foreign += dropped.foreign_messages;
    if (dropped.decode_errors + dropped.foreign_messages > 0) by += (by.empty() ? "" : ", ") + name;
  }
  if (by.empty()) return "";
  return "messages dropped by " + by + ": " + std::to_string(undecoded) + " did not decode, " +
         std::to_string(foreign) + " were repeated or of another episode";
}

void RunController::StartAttempt(int attempt) {
  episode_.reset();
  ended_.reset();
  foreign_model_.clear();
  begun_ = started_ = recorded_ = own_model_heard_ = false;
  early_begin_.reset();
  end_.reset();
  waiting_since_ = {};
  attempt_ = attempt;
}

void RunController::Retry(const std::string& why) {
  BeginAgain(why);
  folder_.DiscardEpisode(episode_index());
}

// Leaves the folder to the recorder, which may be about to close the log of the attempt that was aborted.
void RunController::BeginAgain(const std::string& why) {
  if (attempt_ + 1 >= plan_.max_attempts) {
    throw EnvironmentError("episode " + std::to_string(episode_index()) + " failed " +
                           std::to_string(plan_.max_attempts) + " times, the last time: " + why +
                           WhyNoSpace(folder_.path()));
  }
  listener_->OnRemark(fmt::format("{:>7}  begun again: {}", episode_index(), why));
  StartAttempt(attempt_ + 1);
}

}  // namespace evalbus::launch
