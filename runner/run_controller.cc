#include "runner/run_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/disk.h"
#include "base/errors.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/message_equality.h"
#include "results/episode_json.h"
#include "results/pacing.h"

namespace evalbus::runner {
namespace {

constexpr auto kRepeatCommand = std::chrono::milliseconds(500);
constexpr auto kRecorderTimeout = std::chrono::seconds(10);
constexpr auto kSummaryTimeout = std::chrono::seconds(10);
// Timeout for STATUS, which live components publish at least every 500 ms.
constexpr auto kSilence = std::chrono::seconds(10);
// Timeout after a start, because loading programs and models takes longer on a busy machine.
constexpr auto kStartSilence = std::chrono::seconds(60);

// Compares properties that the robot's description contains but its compiled model does not.
bool SameRobot(const model_info_t& a, const model_info_t& b) {
  const auto same = [](const auto& x, const auto& y) {
    return std::ranges::equal(x, y, [](const auto& m, const auto& n) { return Encode(m) == Encode(n); });
  };
  return a.robot == b.robot && same(a.arm, b.arm) && same(a.gripper, b.gripper);
}

}  // namespace

ModelHashes ModelHashes::Of(const model_info_t& model) {
  return {Sha256Text(model.task_yaml), model.physics_sha256, model.visual_sha256,
          model.limits_yaml.empty() ? "" : Sha256Text(model.limits_yaml)};
}

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
  bus->Subscribe(channels::kPolicyAction, [this](const policy_action_t& action) {
    if (attempt_.begun() && !done() && IsOurs(action.header)) attempt_.calls.Add(action);
  });
  bus->Subscribe(channels::kStatus, [this](const component_status_t& status) { OnStatus(status); });
  bus->Subscribe(channels::kLog, [this](const log_t& line) { OnLog(line); });
}

int64_t RunController::seed() const { return plan_.seeds().OfEpisode(episode_index()); }

void RunController::Command() {
  bus().SetMaxBatchDelay({});
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = episode_index();
  command.attempt = attempt_.number;
  command.seed = seed();
  command.required_component = plan_.required;
  command.num_required = static_cast<int32_t>(plan_.required.size());
  for (const std::string& name : plan_.required) {
    const auto found = instances_.find(name);
    command.required_instance.push_back(found == instances_.end() ? 0 : found->second);
  }
  bus().Publish(channels::kCommand, command);
  command_.MarkSent(std::chrono::steady_clock::now());
}

void RunController::OnModel(const model_info_t& model) {
  if (model.physics_file != own_model_) {
    attempt_.foreign_model = model.physics_file;
    return;
  }
  CheckUnchanged(model);
  attempt_.own_model_received = true;
  if (attempt_.early_begin) OnBegin(*std::exchange(attempt_.early_begin, std::nullopt));
}

void RunController::CheckUnchanged(const model_info_t& model) {
  if (!model_) model_ = model;
  const ModelHashes now = ModelHashes::Of(model);
  const std::string changed =
      now.task_sha256 != plan_.model_hashes.task_sha256         ? model.task_file
      : now.physics_sha256 != plan_.model_hashes.physics_sha256 ? "a file of the physics model"
      : now.visual_sha256 != plan_.model_hashes.visual_sha256   ? "a file of the visual model"
      : now.limits_sha256 != plan_.model_hashes.limits_sha256   ? model.limits_file
      : !SameRobot(model, *model_)                              ? "robot " + model.robot
                                                                : "";
  if (changed.empty()) return;
  throw InputError(changed + " changed during the run; restore it and use --resume, or start a new run");
}

void RunController::OnBegin(const episode_begin_t& begin) {
  if (done() || begin.header.episode != episode_index() || begin.header.attempt != attempt_.number ||
      begin.seed != seed()) {
    return;
  }
  // Before this run's sim has published MODEL, this message may come from an old log with the same seed.
  if (!attempt_.own_model_received) {
    attempt_.early_begin = begin;
    return;
  }
  if (!EnterEpisode(begin)) return;
  conflicts_.Start();
  attempt_.begin = begin;
  batch_delay_.Begin(std::chrono::steady_clock::now());
  PublishReady();
  listener_->OnEpisodeBegin(begin);
}

void RunController::OnPartial(const partial_metrics_t& partial) {
  if (!attempt_.begun() || !IsOurs(partial.header)) return;
  attempt_.started = true;
  bus().SetMaxBatchDelay(batch_delay_.At(std::chrono::steady_clock::now()));
  listener_->OnPartial(partial);
}

void RunController::OnEnd(const episode_end_t& end) {
  if (done() || !attempt_.begun() || !IsOurs(end.header)) return;
  if (conflicts_.Check(channels::kEpisodeEnd, 0, bus().handled()) == ConflictDetector::Answer::kConflicting) {
    return BeginAgain(conflicts_.conflict());
  }
  bus().SetMaxBatchDelay({});
  attempt_.end = end;
  attempt_.ended.emplace(std::chrono::steady_clock::now());
  // EPISODE_END suffices to repeat the attempt. The metrics process may be in another episode and then
  // publishes no summary.
  if (const auto why = WhyWorthless(end.end_reason, end.detail)) return BeginAgain(*why);
  FinishIfRecorded();
}

std::optional<std::string> RunController::WhyWorthless(const std::string& end_reason,
                                                       const std::string& detail) const {
  if (end_reason == end_reason::kAborted) return detail;
  if (end_reason == end_reason::kServerError && has_another_try())
    return "the policy's server failed: " + detail;
  return std::nullopt;
}

void RunController::OnSummary(const episode_summary_t& summary) {
  if (done() || !attempt_.begun() || !IsOurs(summary.header)) return;
  if (const auto why = WhyWorthless(summary.end_reason, summary.end_detail)) return BeginAgain(*why);
  if (summary.seed != seed()) {
    return BeginAgain("the episode was started with another seed: is a second run on this bus?");
  }
  if (!attempt_.foreign_model.empty()) {
    return BeginAgain("a sim or a log of another run publishes on this bus: " + attempt_.foreign_model);
  }
  // The first summary may come from an old log. This run's own summary then differs from it.
  if (conflicts_.Check(channels::kEpisodeSummary, 0, bus().handled()) ==
      ConflictDetector::Answer::kConflicting) {
    return BeginAgain(conflicts_.conflict());
  }
  if (attempt_.summary) return;
  attempt_.summary = summary;
  FinishIfRecorded();
}

void RunController::OnStatus(const component_status_t& status) {
  const bool is_guest = plan_.policy_is_external && !plan_.is_by_hand && status.component == "policy";
  if (is_guest || silence_.contains(status.component)) {
    silence_.insert_or_assign(status.component, Silence{Wait(std::chrono::steady_clock::now()), kSilence});
  }
  if (status.state == component_status_t::FAILED) {
    if (is_guest) {
      attempt_.policy_error = status.error;
    } else if (silence_.contains(status.component)) {
      attempt_.has_failed_process = true;
    }
  }
  if (status.component == "sim" ||
      std::ranges::find(plan_.required, status.component) != plan_.required.end()) {
    Dropped& dropped = dropped_[status.component];
    dropped.decode_errors = std::max(dropped.decode_errors, status.decode_errors);
    dropped.foreign_messages = std::max(dropped.foreign_messages, status.foreign_messages);
  }
  if (done()) return;
  // A sim that has just started has not received the COMMAND yet, so it is sent again.
  if (status.component == "sim" && !attempt_.begun() &&
      std::exchange(sim_, status.instance) != status.instance) {
    Command();
  }
  if (status.attempt != attempt_.number) return;
  if (status.last_finished_episode != episode_index()) {
    // The sim published this STATUS after the log was closed, but had not ended the episode yet.
    if (status.component == "sim" && status.state == component_status_t::READY &&
        status.episode == episode_index() && attempt_.recorded && !attempt_.ended) {
      BeginAgain(
          "the episode's log was closed before the episode ended: is an old log being played on this bus?");
    }
    return;
  }
  // The sim's EPISODE_END may have been lost.
  if (status.component == "sim" && attempt_.begun() && !attempt_.ended) {
    attempt_.ended.emplace(std::chrono::steady_clock::now());
  }
  if (status.component == "recorder") {
    // Missing ticks in the log do not affect the scores, so the last attempt is accepted.
    if (status.last_finished_missing_ticks > 0 && !plan_.realtime && !plan_.is_watched && has_another_try()) {
      const int64_t missing = status.last_finished_missing_ticks;
      return BeginAgain(
          fmt::format("the log lacks {}: lost on the way to the recorder", Plural(missing, "tick")));
    }
    attempt_.recorded = true;
  }
  FinishIfRecorded();
}

void RunController::OnLog(const log_t& line) {
  // This component's own lines have already been reported as remarks.
  if (line.level < log_t::WARN_LEVEL || line.component == status_.component) return;
  listener_->OnRemark(
      Printable(fmt::format("{:>9}  {}: {}", line.component, PlaceText(line.header), line.text)));
}

void RunController::FinishIfRecorded() {
  if (!attempt_.ended || !attempt_.summary || !attempt_.recorded || attempt_.has_failed_process) return;
  const episode_summary_t& summary = *attempt_.summary;
  // The metrics process copies tick and reason from EPISODE_END. They are compared only if this process has
  // also received EPISODE_END.
  if (attempt_.end &&
      (!SameTick(attempt_.end->header, summary.header) || attempt_.end->end_reason != summary.end_reason)) {
    return BeginAgain("EPISODE_SUMMARY does not match EPISODE_END: is an old log being played on this bus?");
  }
  const bool is_decided = summary.end_reason == end_reason::kSuccess ||
                          summary.end_reason == end_reason::kFailure ||
                          summary.end_reason == end_reason::kTimeLimit;
  const int64_t scored_ticks = results::ScoredTicks(summary);
  bool lacks_call = false;
  if (plan_.calls && is_decided) {
    attempt_.calls.RemoveUndecided(summary.header.tick);
    lacks_call = !plan_.realtime && !attempt_.calls.IsWhole(*plan_.calls, scored_ticks);
    if (lacks_call && has_another_try())
      return BeginAgain("the message about a call to the policy was lost on the way to the launcher");
  }
  nlohmann::ordered_json line = results::EpisodeJson(plan_.task, plan_.variation, summary,
                                                     plan_.is_watched ? nullptr : &*attempt_.begin);
  if (plan_.trained_on) {
    line[metrics::kSeenInTraining] =
        plan_.trained_on->Contain(plan_.task + "/" + plan_.variation, line["parameters"]);
  }
  if (plan_.realtime) {
    line["pacing"] = attempt_.end ? results::EpisodePacing(*attempt_.end, summary.extended.deadline_misses)
                                  : nlohmann::ordered_json();
  }
  if (plan_.calls) {
    // The other scores do not depend on the messages about calls, so the last attempt is accepted.
    if (lacks_call) {
      listener_->OnRemark(fmt::format(
          "{:>7}  has no metrics of the policy's delay: the message about a call was lost", episode_index()));
    }
    const nlohmann::ordered_json calls = attempt_.calls.Json(*plan_.calls, lacks_call ? 0 : scored_ticks);
    results::AddDelayMetrics(calls, summary, &line);
    folder_.AddPolicyCalls(episode_index(), calls);
    const std::string warning = results::RareCallsWarning({calls});
    if (!warning.empty() && !std::exchange(rare_calls_reported_, true)) {
      listener_->OnRemark(fmt::format("{:>7}  {}", episode_index(), warning));
    }
  }
  folder_.AddEpisode(episode_index(), line);
  listener_->OnEpisodeDone(line);
  if (summary.end_reason == end_reason::kServerError) {
    listener_->OnRemark(fmt::format("{:>7}  invalid after {} attempts: the policy's server failed: {}",
                                    episode_index(), attempt_.number + 1, summary.end_detail));
  }
  attempt_ = {};
  ++next_;
  if (!done()) Command();
}

void RunController::Poll(SteadyTime now) {
  Component::Poll(now);
  if (bus().foreign_messages() > 0 && !std::exchange(foreign_reported_, true)) {
    listener_->OnRemark(
        "warning: another run, or a log being played, publishes on this bus: its messages are ignored");
  }
  if (done()) return;
  if (!attempt_.waiting) attempt_.waiting.emplace(now);
  const auto waited = attempt_.waiting->Elapsed(now);
  CheckPolicyComes(waited);
  if (!attempt_.begun() && command_.Due(now)) Command();
  // This timeout is reached if all components are alive, but the sim or a component that it waits for is in
  // an episode that another process started.
  const double start_s =
      std::max(std::chrono::duration<double>(kStartSilence).count(), plan_.policy_timeout_s);
  if (!attempt_.started && waited > std::chrono::duration<double>(start_s) && !plan_.is_by_hand &&
      !plan_.is_watched) {
    BeginAgain(
        fmt::format("not all components were ready for the episode within {:g} s; does another process "
                    "publish commands on this bus?",
                    start_s));
    return;
  }
  // The timeouts below are reached if EPISODE_SUMMARY or the recorder's STATUS was lost, or if a component is
  // in an episode that another process started.
  if (!attempt_.ended) return;
  if (!attempt_.summary && attempt_.ended->Elapsed(now) > kSummaryTimeout) {
    BeginAgain("no EPISODE_SUMMARY from metrics within 10 s after the episode's end");
    return;
  }
  if (!attempt_.summary) return;
  if (!attempt_.unrecorded) attempt_.unrecorded.emplace(now);
  if (attempt_.unrecorded->Elapsed(now) > kRecorderTimeout) {
    BeginAgain("the recorder did not finish the episode's log within 10 s");
  }
}

void RunController::CheckPolicyComes(SteadyTime::duration waited) const {
  if (!plan_.policy_is_external || plan_.is_by_hand || attempt_.started) return;
  if (waited <= std::chrono::duration<double>(plan_.policy_timeout_s)) return;
  throw EnvironmentError(
      fmt::format("no policy reported that it is ready for episode {} within {:g} s (--policy-timeout-s){}",
                  episode_index(), plan_.policy_timeout_s,
                  attempt_.policy_error.empty() ? "" : ": " + attempt_.policy_error));
}

void RunController::ExpectStart(const std::map<std::string, int64_t>& instances) {
  instances_ = instances;
  const Silence start{Wait(std::chrono::steady_clock::now()), kStartSilence};
  silence_.insert_or_assign("sim", start);
  for (const std::string& name : plan_.required) silence_.insert_or_assign(name, start);
  if (plan_.policy_is_external) silence_.erase("policy");
}

std::string RunController::Silent(SteadyTime now) {
  std::string silent;
  for (auto& [name, silence] : silence_) {
    if (silence.wait.Elapsed(now) < silence.allowed || !silent.empty()) continue;
    silent = fmt::format("{} hangs: no STATUS for {:g} s", name,
                         std::chrono::duration<double>(silence.allowed).count());
  }
  return silent;
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
  const std::string others = std::to_string(foreign) + " were repeated or belong to another episode or run";
  if (undecoded == 0) return "messages ignored by " + by + ": " + others + " (no effect on results)";
  return "messages dropped by " + by + ": " + std::to_string(undecoded) + " could not be decoded, " + others;
}

void RunController::Retry(const std::string& why) {
  BeginAgain(why);
  folder_.DiscardEpisode(episode_index());
}

// Does not change the folder, because the recorder may still be closing the log of the aborted attempt.
void RunController::BeginAgain(const std::string& why) {
  if (!has_another_try()) {
    // If the disk is full, a component's log cannot contain the error.
    const std::string disk = WhyNotWritable(folder_.path());
    throw EnvironmentError(fmt::format("episode {} failed {} times, the last time: {}{}{}", episode_index(),
                                       plan_.max_attempts, why, disk.empty() ? "" : "; ", disk));
  }
  log().Warn("retrying: {}", why);
  listener_->OnRemark(fmt::format("{:>7}  retrying: {}", episode_index(), why));
  const int next = attempt_.number + 1;
  attempt_ = {};
  attempt_.number = next;
}

}  // namespace evalbus::runner
