#include "bus/recorder/recorder.h"

#include <algorithm>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/source.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// kMaxLagWindowTicks: maximum number of ticks by which the sim may be ahead of the recorder; fewer if the
// receive buffer does not have kTickBytes for each. The messages of one tick of a large scene take half of
// kTickBytes.
constexpr int64_t kMaxLagWindowTicks = 256;
constexpr size_t kTickBytes = 32 << 10;

int64_t LagWindowTicks(std::optional<size_t> receive_buffer_bytes) {
  if (!receive_buffer_bytes) return kMaxLagWindowTicks;
  return std::clamp<int64_t>(static_cast<int64_t>(*receive_buffer_bytes / kTickBytes), 2, kMaxLagWindowTicks);
}

constexpr auto kRunSummaryWait = std::chrono::seconds(1);

// Runs a file operation on `path`. Throws EnvironmentError if it fails.
template <class F>
void OnDisk(const fs::path& path, const F& f) {
  try {
    f();
  } catch (const fs::filesystem_error& error) {
    throw EnvironmentError("cannot write " + path.string() + ": " + error.code().message());
  }
}

}  // namespace

Recorder::Recorder(Bus* bus, std::filesystem::path run, LogForm form)
    : Component(bus, "recorder", kMaxLagWindowTicks), run_(std::move(run)), form_(form) {
  std::error_code error;
  std::filesystem::create_directories(run_ / kEpisodesFolder, error);
  if (error) throw InputError("cannot create " + (run_ / kEpisodesFolder).string() + ": " + error.message());
  bus->SubscribeRaw(".*", [this](std::string_view channel, std::span<const uint8_t> data, int64_t time_us) {
    Record(channel, data, time_us);
  });
  status_.lag_window_ticks = LagWindowTicks(bus->receive_buffer_bytes());
}

void Recorder::Poll(SteadyTime now) {
  Component::Poll(now);
  if (closing_ && closing_->Elapsed(now) >= kRunSummaryWait) CloseEpisode();
}

bool Recorder::OnModel(std::span<const uint8_t> data, int64_t receive_time_us) {
  model_info_t model{};
  Decode(data, &model);
  if (!IsNewModel()) return std::ranges::equal(data, model_);
  simulated_time_ = model.clock != clock_name::kRealtime;
  is_watched_ = model.source != source_name::kSim;
  model_.assign(data.begin(), data.end());
  model_time_us_ = receive_time_us;
  return true;
}

void Recorder::OnEpisodeBegin(std::span<const uint8_t> data) {
  episode_begin_t begin{};
  Decode(data, &begin);
  // If no MODEL was received before, the episode does not come from this run's sim.
  if (model_.empty()) return;
  if (!HasEntered(begin) && closing_) CloseEpisode();  // RUN_SUMMARY of the previous episode was not received
  if (!HasEntered(begin) && !MayBegin(begin)) return;
  const auto left = UnfinishedEpisodeFolder(run_, status_.episode);
  if (!EnterEpisode(begin)) return;
  if (events_) {
    log().Warn("dropping the unfinished log {}", left.string());
    events_.reset();
    OnDisk(left, [&] { fs::remove_all(left); });
  }
  Open(begin);
}

bool Recorder::MayBegin(const episode_begin_t& begin) {
  const auto finished = EpisodeFolder(run_, begin.header.episode);
  if (!fs::exists(finished)) return true;
  // The log of an aborted attempt is closed like any other log, and the log of the next attempt replaces it.
  // If a summary exists, the launcher has counted the episode, so its log is final.
  if (begin.header.attempt > 0 && !fs::exists(finished / kSummaryJson)) {
    OnDisk(finished, [&] { fs::remove_all(finished); });
    return true;
  }
  // A launcher never begins an episode that is recorded already, but a manually started recorder can receive
  // one.
  if (status_.episode < 0 && bus().session() == 0) {
    throw InputError(finished.string() +
                     " exists: this episode has already been recorded; choose another --out");
  }
  // This run has already finished the episode, so the message comes from an old log that is being replayed.
  ++status_.foreign_messages;
  log().Warn("an EPISODE_BEGIN of episode {}, which has already been recorded: is an old log being played?",
             begin.header.episode);
  return false;
}

void Recorder::Open(const episode_begin_t& begin) {
  const auto folder = UnfinishedEpisodeFolder(run_, begin.header.episode);
  OnDisk(folder, [&] {
    // Data of an earlier attempt are discarded.
    fs::remove_all(folder);
    fs::create_directories(folder);
  });
  events_.emplace(folder / kEventLog);
  log().Info("opens {}", (folder / kEventLog).string());
  time_us_ = 0;
  end_.reset();
  has_summary_ = false;
  received_.clear();
  batch_delay_.Begin(std::chrono::steady_clock::now());
  events_->Write(channels::kModel, model_, simulated_time_ ? 0 : model_time_us_);
  PublishReady();
}

void Recorder::Record(std::string_view channel, std::span<const uint8_t> data, int64_t receive_time_us) {
  // Channels with kNo are not recorded. For example, rendered images can be rendered again from the log, and
  // observers, which cause them, must not change the recorded data.
  const Recorded recorded = channels::RecordedOf(channel);
  if (recorded == Recorded::kNo) return;
  if (!channels::MatchesChannelType(channel, data, &decoded_)) return bus().CountDecodeError();
  // Clears the session, so that runs with equal seeds leave equal logs.
  if (channels::CarriesSession(channel) && SessionOf(data) != 0) {
    without_session_.assign(data.begin(), data.end());
    SetSession(0, without_session_);
    data = without_session_;
  }
  if (channel == channels::kModel && !OnModel(data, receive_time_us)) return;
  if (channel == channels::kEpisodeBegin) OnEpisodeBegin(data);
  if (!events_) return;
  // Metrics repeats RUN_SUMMARY at times that depend on the machine. The log contains only the RUN_SUMMARY
  // that follows this episode's EPISODE_SUMMARY.
  const bool is_run_summary = channel == channels::kRunSummary;
  if (is_run_summary && !closing_) return;
  Received* received = nullptr;
  if (recorded == Recorded::kOncePerTick || recorded == Recorded::kOncePerEpisode) {
    auto found = received_.find(channel);
    if (found == received_.end()) found = received_.emplace(channel, Received{}).first;
    received = &found->second;
    // A message that was repeated (on a slow machine or lossy network) is already in the log.
    if (!UpdateIfChanged(data, &received->last)) return;
  }
  header_t header{};
  const bool is_next_state = channel == channels::kState && DecodeHeader<state_t>(data, &header) &&
                             IsOurs(header) && header.tick > status_.last_tick;
  if (is_next_state) time_us_ = header.sim_time_us;
  events_->Write(channel, data, simulated_time_ ? time_us_ : receive_time_us);
  if (const auto tick = channels::TickOf(channel, data);
      tick && tick->episode == status_.episode && tick->attempt == status_.attempt) {
    received->ticks.Add(tick->tick);
  }
  if (is_next_state) {
    status_.missing_ticks += header.tick - status_.last_tick - 1;
    Progress(header);
    bus().SetMaxBatchDelay(batch_delay_.At(std::chrono::steady_clock::now()));
  } else if (channel == channels::kEpisodeEnd) {
    bus().SetMaxBatchDelay({});
    episode_end_t end{};
    if (!end_ && Decode(data, &end) && IsOurs(end.header)) end_ = end;
  } else if (channel == channels::kEpisodeSummary) {
    has_summary_ = has_summary_ || (DecodeHeader<episode_summary_t>(data, &header) && IsOurs(header));
  } else if (is_run_summary) {
    return CloseEpisode();
  }
  if (end_ && has_summary_ && !closing_) closing_.emplace(std::chrono::steady_clock::now());
}

int64_t Recorder::MissingTicks() const {
  // An aborted episode is not evaluated, so missing ticks do not matter.
  if (end_->end_reason == end_reason::kAborted) return 0;
  const int64_t last = end_->header.tick;
  const auto missing = [&](const char* channel, int64_t end) {
    const auto found = received_.find(std::string_view(channel));
    return found == received_.end() ? end : found->second.ticks.MissingBefore(end);
  };
  const int64_t states = missing(channels::kState.name, last + 1);
  // In real time, the sim does not wait for answers, so it is unknown which answers were sent.
  if (!simulated_time_) return states;
  const int64_t scores = std::max(
      {states, missing(channels::kContacts.name, last + 1), missing(channels::kPartial.name, last + 1)});
  // If a source moves the robot, there are no ACTIONs.
  return is_watched_ ? scores : std::max(scores, missing(channels::kAction.name, last));
}

void Recorder::CloseEpisode() {
  const int64_t num_events = events_->num_events();
  // Observers read the plain log until the rename; the packed log appears together with the finished episode.
  form_ == LogForm::kZstd ? events_->ClosePacked() : events_->Close();
  events_.reset();
  closing_.reset();
  const auto finished = EpisodeFolder(run_, status_.episode);
  OnDisk(finished, [&] { fs::rename(UnfinishedEpisodeFolder(run_, status_.episode), finished); });
  log().Info("closed and synced {}, {} events", EpisodeLog(run_, status_.episode).string(), num_events);
  status_.last_finished_episode = status_.episode;
  const int64_t missing = status_.last_finished_missing_ticks = MissingTicks();
  if (missing > 0)
    log().Warn("the log lacks {}: {}lost on the way to the recorder", Plural(missing, "tick"),
               is_watched_ ? "never sent, or " : "");
  PublishStatus();
}

}  // namespace evalbus
