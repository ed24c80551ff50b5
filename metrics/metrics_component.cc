#include "metrics/metrics_component.h"

#include "base/text.h"
#include "bus/channels.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "metrics/episode/result_json.h"
#include "models/task_description.h"

namespace evalbus::metrics {
namespace {

// RUN_SUMMARY is repeated for observers that subscribe in the middle of a run.
constexpr auto kRepeatSummary = std::chrono::seconds(1);

// Returns the verdict of `summary` if it contradicts the sim's end reason, else "". In lockstep, if there is
// a verdict, the sim ends the episode on it and for no other reason, unless the policy's server fails after a
// success. A contradiction means that the sim followed the score of another metrics process.
std::string Conflict(const std::string& end_reason, const episode_summary_t& summary) {
  if (end_reason == end_reason::kAborted || end_reason == end_reason::kServerError ||
      summary.extended.missing_ticks + summary.extended.refused_samples > 0) {
    return "";
  }
  const std::string verdict = end_reason::Of(summary.verdict);
  const bool ended_on_verdict = end_reason == end_reason::kSuccess || end_reason == end_reason::kFailure;
  if (end_reason == verdict || (verdict.empty() && !ended_on_verdict)) return "";
  return verdict.empty() ? "undecided" : verdict;
}

}  // namespace

MetricsComponent::MetricsComponent(Bus* bus, bool is_part) : Component(bus, "metrics"), is_part_(is_part) {
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnTickMessage(channels::kState, m); });
  bus->Subscribe(channels::kContacts, [this](const contacts_t& m) { OnTickMessage(channels::kContacts, m); });
  bus->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& m) { OnEpisodeEnd(m); });
}

void MetricsComponent::OnModel(const model_info_t& model) {
  if (!IsNewModel()) return;
  model_ = model;
  model_is_new_ = true;
}

void MetricsComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  if (EnterEpisode(begin)) {
    begin_ = begin;
    running_ = false;
    summary_.reset();
    last_ticks_.reset();
  }
  // EPISODE_BEGIN is repeated, so an episode whose MODEL arrives late is prepared at a later repetition.
  if (status_.state == component_status_t::IDLE) Prepare();
}

void MetricsComponent::Prepare() {
  if (!model_) return;
  if (model_is_new_) {
    TaskDescription task = ParseTask(model_->task_yaml, model_->task_file, false);
    task.Apply(model_->variation);
    task.ApplyRobot(model_->robot, ArmNames(*model_));
    scorer_ = std::make_unique<EpisodeScorer>(*model_, task);
    criteria_ = {};
    log().Debug("scores {}/{}", model_->task, model_->variation);
    is_lockstep_ = model_->clock != clock_name::kRealtime;
    model_is_new_ = false;
  }
  scorer_->Start();
  merger_.Start();
  conflicts_.Start();
  criteria_pace_.Start();
  partial_.header.tick = -1;
  missing_before_ += missing_here_;
  missing_here_ = 0;
  running_ = true;
  PublishReady();
}

template <class Message>
void MetricsComponent::OnTickMessage(const Channel<Message>& channel, const Message& message) {
  if (!IsOurs(message.header)) return;
  const int64_t tick = message.header.tick;
  if (running_ && merger_.IsNear(tick)) {
    const ConflictDetector::Answer answer = conflicts_.Check(channel, tick, bus().handled());
    if (answer == ConflictDetector::Answer::kNew && merger_.Add(message)) return ScoreTicks();
    // The sim repeats a STATE if an answer to it is missing, which may be this PARTIAL.
    if (answer == ConflictDetector::Answer::kConflicting) log().Warn("{}", conflicts_.conflict());
    if (answer == ConflictDetector::Answer::kRepeated && tick == partial_.header.tick) {
      bus().Publish(channels::kPartial, partial_);
    }
  }
  ++status_.foreign_messages;
}

void MetricsComponent::ScoreTicks() {
  TickMerger::Pair pair{};
  while (running_ && merger_.Next(&pair)) {
    const header_t header = pair.state->header;
    scorer_->Tick(*pair.state, *pair.contacts);
    scorer_->Partial(&partial_);
    missing_here_ = scorer_->missing_ticks();
    status_.missing_ticks = missing_before_ + missing_here_;
    Progress(header);
    bus().Publish(channels::kPartial, partial_);
    // No component waits for CRITERIA, so it is published less often than PARTIAL.
    if (criteria_pace_.IsDue(header, partial_.verdict)) PublishCriteria();
  }
  if (running_ && merger_.finished()) FinishEpisode();
}

void MetricsComponent::PublishCriteria() {
  scorer_->Criteria(&criteria_);
  bus().Publish(channels::kCriteria, criteria_);
}

void MetricsComponent::OnEpisodeEnd(const episode_end_t& end) {
  if (!IsOurs(end.header)) return;
  if (running_) {
    const auto answer = conflicts_.Check(channels::kEpisodeEnd, 0, bus().handled());
    if (answer == ConflictDetector::Answer::kConflicting) {
      log().Warn("{}", conflicts_.conflict());
      return FinishEpisode();
    }
  }
  if (!running_ || last_ticks_) {
    ++status_.foreign_messages;
    // The sim repeats EPISODE_END until the next episode begins.
    if (summary_) {
      log().Info("received EPISODE_END again: resending the score");
      bus().Publish(channels::kEpisodeSummary, *summary_);
    }
    return;
  }
  end_ = end;
  last_ticks_.emplace(std::chrono::steady_clock::now());
  merger_.EndAt(end.header.tick);
  ScoreTicks();
}

void MetricsComponent::Poll(SteadyTime now) {
  Component::Poll(now);
  if (run_summary_.num_episodes > 0 && now - summary_published_ >= kRepeatSummary) PublishRunSummary();
  if (!last_ticks_ || last_ticks_->Elapsed(now) < kMaxWait) return;
  log().Warn("some ticks did not arrive in time: the episode is scored without them");
  merger_.GiveUp();
  ScoreTicks();
}

void MetricsComponent::FinishEpisode() {
  running_ = false;
  last_ticks_.reset();
  if (partial_.header.tick >= 0 && !criteria_pace_.IsPublished(partial_.header)) PublishCriteria();
  scorer_->EndAt(end_.header.tick);
  missing_here_ = scorer_->missing_ticks();
  status_.missing_ticks = missing_before_ + missing_here_;
  status_.last_finished_episode = end_.header.episode;

  // The score is not reliable, because it is unknown which of the two conflicting messages came from the sim.
  if (!conflicts_.conflict().empty()) {
    end_.end_reason = end_reason::kAborted;
    end_.detail = conflicts_.conflict();
  }
  episode_summary_t& summary = summary_.emplace(scorer_->Summary(begin_, end_));
  if (const std::string verdict = Conflict(end_.end_reason, summary); is_lockstep_ && !verdict.empty()) {
    end_.detail = "the sim ended the episode with " + end_.end_reason + ", but the verdict was " + verdict +
                  ": is a second metrics process on this bus?";
    end_.end_reason = end_reason::kAborted;
    log().Warn("{}", end_.detail);
    summary = scorer_->Summary(begin_, end_);
  }
  if (summary.extended.refused_samples > 0) {
    log().Warn("refused {} with numbers that are not finite or do not fit the model",
               Plural(summary.extended.refused_samples, "tick"));
  }
  statistics_.Add(end_.header.episode, ResultOf(begin_, summary));
  run_summary_ = SummaryMessage(statistics_.Summary(false));
  run_summary_.is_part = is_part_ || !statistics_.is_without_gap();

  bus().Publish(channels::kEpisodeSummary, summary);
  PublishRunSummary();
  PublishStatus();
}

void MetricsComponent::PublishRunSummary() {
  bus().Publish(channels::kRunSummary, run_summary_);
  summary_published_ = std::chrono::steady_clock::now();
}

}  // namespace evalbus::metrics
