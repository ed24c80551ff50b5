#include "cli/launch/run_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "base/text.h"
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
    : Component(bus, "run"),
      plan_(plan),
      folder_(folder),
      listener_(listener),
      own_model_(std::filesystem::absolute(folder.path() / kModelFolder / kPhysicsModel).lexically_normal()),
      command_(kRepeatCommand) {
  bus->Subscribe(channels::kModel, [this](const model_info_t& model) { OnModel(model); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& begin) { OnBegin(begin); });
  bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& partial) { OnPartial(partial); });
  bus->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& end) { OnEnd(end); });
  bus->Subscribe(channels::kEpisodeSummary, [this](const episode_summary_t& summary) { OnSummary(summary); });
  bus->Subscribe(channels::kStatus, [this](const component_status_t& status) { OnStatus(status); });
  bus->Subscribe(channels::kLog, [this](const log_t& line) { OnLog(line); });
}

int64_t RunController::seed() const { return EpisodeSeed(plan_.seed, episode_index()); }

void RunController::Command() {
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = episode_index();
  command.attempt = attempt_.number;
  command.seed = seed();
  command.required_component = plan_.required;
  command.num_required = static_cast<int32_t>(plan_.required.size());
  bus().Publish(channels::kCommand, command);
  command_.Said(std::chrono::steady_clock::now());
}

void RunController::OnModel(const model_info_t& model) {
  if (model.physics_file != own_model_) {
    attempt_.foreign_model = model.physics_file;
    return;
  }
  attempt_.own_model_heard = true;
  if (attempt_.early_begin) OnBegin(*std::exchange(attempt_.early_begin, std::nullopt));
}

void RunController::OnBegin(const episode_begin_t& begin) {
  if (done() || begin.header.episode != episode_index() || begin.header.attempt != attempt_.number ||
      begin.seed != seed()) {
    return;
  }
  // Before our sim has said anything, this may be an old log of the same seed.
  if (!attempt_.own_model_heard) {
    attempt_.early_begin = begin;
    return;
  }
  if (!EnterEpisode(begin)) return;
  conflicts_.Start();
  attempt_.begun = true;
  SayReady();
  listener_->OnEpisodeBegin(begin);
}

void RunController::OnPartial(const partial_metrics_t& partial) {
  if (!attempt_.begun || !IsOurs(partial.header)) return;
  attempt_.started = true;
  listener_->OnPartial(partial);
}

void RunController::OnEnd(const episode_end_t& end) {
  if (done() || !attempt_.begun || !IsOurs(end.header)) return;
  if (conflicts_.Hear(channels::kEpisodeEnd, 0, bus().handled()) == ConflictDetector::Answer::kConflicting) {
    return BeginAgain(conflicts_.conflict());
  }
  attempt_.end = end;
  attempt_.ended = std::chrono::steady_clock::now();
  // Metrics may not be able to say so, if it was led into another episode.
  if (end.end_reason == end_reason::kAborted) BeginAgain(end.detail);
}

void RunController::OnSummary(const episode_summary_t& summary) {
  if (done() || !attempt_.begun || !IsOurs(summary.header)) return;
  if (summary.end_reason == end_reason::kAborted) return BeginAgain(summary.end_detail);
  if (summary.seed != seed()) {
    return BeginAgain("begun with a seed that is not ours: is a second run on this bus?");
  }
  if (!attempt_.foreign_model.empty()) {
    return BeginAgain("a sim or a log of another run is on this bus: " + attempt_.foreign_model);
  }
  // One of an old log may come first; ours then differs.
  if (conflicts_.Hear(channels::kEpisodeSummary, 0, bus().handled()) ==
      ConflictDetector::Answer::kConflicting) {
    return BeginAgain(conflicts_.conflict());
  }
  if (attempt_.summary) return;
  attempt_.summary = summary;
  attempt_.summarised = std::chrono::steady_clock::now();
  FinishIfRecorded();
}

void RunController::OnStatus(const component_status_t& status) {
  const bool is_guest = plan_.policy_is_external && status.component == "policy";
  if (is_guest || silent_at_.contains(status.component)) {
    silent_at_[status.component] = std::chrono::steady_clock::now() + kSilence;
  }
  if (is_guest && status.state == component_status_t::FAILED) attempt_.policy_error = status.error;
  if (status.component == "sim" ||
      std::ranges::find(plan_.required, status.component) != plan_.required.end()) {
    Dropped& dropped = dropped_[status.component];
    dropped.decode_errors = std::max(dropped.decode_errors, status.decode_errors);
    dropped.foreign_messages = std::max(dropped.foreign_messages, status.foreign_messages);
  }
  if (done() || status.attempt != attempt_.number || status.last_finished_episode != episode_index()) return;
  // Its EPISODE_END may have been lost.
  if (status.component == "sim" && attempt_.begun && !attempt_.ended) {
    attempt_.ended = std::chrono::steady_clock::now();
  }
  if (status.component == "recorder") {
    if (!attempt_.ended) {
      return BeginAgain("its log was closed before its end: is an old log being played on this bus?");
    }
    attempt_.recorded = true;
  }
  FinishIfRecorded();
}

void RunController::OnLog(const log_t& line) {
  // Our own lines are remarks already.
  if (line.level < log_t::WARN_LEVEL || line.component == status_.component) return;
  listener_->OnRemark(
      Printable(fmt::format("{:>9}  {}: {}", line.component, PlaceText(line.header), line.text)));
}

void RunController::FinishIfRecorded() {
  if (!attempt_.ended || !attempt_.summary || !attempt_.recorded) return;
  const episode_summary_t& summary = *attempt_.summary;
  nlohmann::ordered_json line = results::EpisodeJson(plan_.task, plan_.variation, summary);
  if (plan_.realtime) {
    line["pacing"] = attempt_.end ? results::EpisodePacing(*attempt_.end, summary.extended.deadline_misses)
                                  : nlohmann::ordered_json();
  }
  folder_.AddEpisode(episode_index(), line);
  listener_->OnEpisodeDone(line);
  attempt_ = {};
  ++next_;
  if (!done()) Command();
}

void RunController::Poll(SteadyTime now) {
  Component::Poll(now);
  if (done()) return;
  if (attempt_.waiting_since == SteadyTime{}) attempt_.waiting_since = now;
  CheckPolicyComes(now);
  if (!attempt_.begun && command_.Due(now)) Command();
  const auto waited_s = std::chrono::duration<double>(now - attempt_.waiting_since).count();
  // All live, but the sim or somebody it waits for is in an episode that somebody else began.
  const double start_s =
      std::max(std::chrono::duration<double>(kStartSilence).count(), plan_.policy_timeout_s);
  if (!attempt_.started && waited_s > start_s) {
    BeginAgain(fmt::format(
        "not everybody was ready for it within {:g} s: does somebody else command on this bus?", start_s));
    return;
  }
  // EPISODE_END or EPISODE_SUMMARY was lost, or metrics is in an episode that somebody else began.
  if (attempt_.ended && !attempt_.summary && now - *attempt_.ended > kSummaryTimeout) {
    BeginAgain("no EPISODE_SUMMARY from metrics within 10 s after the episode's end");
    return;
  }
  if (attempt_.summary && attempt_.ended &&
      now - std::max(attempt_.summarised, *attempt_.ended) > kRecorderTimeout) {
    BeginAgain("the recorder did not finish the episode's log within 10 s");
  }
}

void RunController::CheckPolicyComes(SteadyTime now) const {
  if (!plan_.policy_is_external || attempt_.started) return;
  if (std::chrono::duration<double>(now - attempt_.waiting_since).count() <= plan_.policy_timeout_s) return;
  throw EnvironmentError(fmt::format(
      "no policy said that it is ready for episode {} within {:g} s (--policy-timeout-s){}", episode_index(),
      plan_.policy_timeout_s, attempt_.policy_error.empty() ? "" : ": " + attempt_.policy_error));
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

void RunController::Retry(const std::string& why) {
  BeginAgain(why);
  folder_.DiscardEpisode(episode_index());
}

// Leaves the folder to the recorder, which may be about to close the log of the attempt that was aborted.
void RunController::BeginAgain(const std::string& why) {
  if (attempt_.number + 1 >= plan_.max_attempts) {
    throw EnvironmentError(fmt::format("episode {} failed {} times, the last time: {}{}", episode_index(),
                                       plan_.max_attempts, why, WhyNoSpace(folder_.path())));
  }
  log().Warn("begins again: {}", why);
  listener_->OnRemark(fmt::format("{:>7}  begun again: {}", episode_index(), why));
  const int next = attempt_.number + 1;
  attempt_ = {};
  attempt_.number = next;
}

}  // namespace evalbus::launch
