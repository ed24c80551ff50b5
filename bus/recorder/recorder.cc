#include "bus/recorder/recorder.h"

#include <algorithm>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/clock.h"

namespace evalbus {
namespace {

// The sim runs at most this far ahead of the disk.
constexpr int64_t kLagWindowTicks = 256;

}  // namespace

Recorder::Recorder(Bus* bus, std::filesystem::path run)
    : Component(bus, "recorder", kLagWindowTicks), run_(std::move(run)) {
  std::error_code error;
  std::filesystem::create_directories(run_ / kEpisodesFolder, error);
  if (error) throw InputError("cannot create " + (run_ / kEpisodesFolder).string() + ": " + error.message());
  bus->SubscribeRaw(".*", [this](const std::string& channel, std::span<const uint8_t> data, int64_t time_us) {
    Record(channel, data, time_us);
  });
}

void Recorder::Poll(SteadyTime now) {
  Component::Poll(now);
  if (close_at_ && now >= *close_at_) CloseEpisode();
}

void Recorder::OnEpisodeBegin(std::span<const uint8_t> data) {
  episode_begin_t begin{};
  if (!Decode(data, &begin)) return;  // the sim's and everybody else's counters show it
  // Like everybody else: what begins before the sim has said what it is, is not the sim's.
  if (model_.empty()) return;
  const bool same_episode = begin.header.episode == status_.episode;
  const bool is_new = !same_episode || begin.header.attempt != status_.attempt;
  if (is_new && close_at_) CloseEpisode();  // RUN_SUMMARY of the episode before never came
  const auto finished = EpisodeFolder(run_, begin.header.episode);
  const bool is_first = status_.episode < 0;
  if (is_new && std::filesystem::exists(finished)) {
    // An aborted attempt was closed like any other; its successor takes its place. Once the launcher has
    // counted an episode, which is when it writes the summary, nothing does.
    if (begin.header.attempt > 0 && !std::filesystem::exists(finished / kSummaryJson)) {
      std::filesystem::remove_all(finished);
    } else if (is_first) {
      throw InputError(finished.string() + " exists: this episode is recorded already; choose another --out");
    } else {
      // Not of this run, which has gone past that episode: an old log is being played.
      ++status_.foreign_messages;
      log().Warn("an EPISODE_BEGIN of episode {}, which is recorded already: is an old log being played?",
                 begin.header.episode);
      return;
    }
  }
  const auto left = UnfinishedEpisodeFolder(run_, status_.episode);
  if (!EnterEpisode(begin)) return;
  if (events_) {
    log().Warn("drops the unfinished log {}", left.string());
    events_.reset();
    std::filesystem::remove_all(left);
  }
  const auto folder = UnfinishedEpisodeFolder(run_, begin.header.episode);
  // What an earlier attempt left is not evidence of anything.
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  events_.emplace(folder / kEventLog);
  log().Info("opens {}", (folder / kEventLog).string());
  time_us_ = 0;
  has_end_ = has_summary_ = false;
  last_said_.clear();
  events_->Write(channels::kModel, model_, simulated_time_ ? 0 : model_time_us_);
  SayReady();
}

void Recorder::Record(const std::string& channel, std::span<const uint8_t> data, int64_t receive_time_us) {
  // Pictures can be drawn again from the log, and who looks on does not change what a run leaves behind.
  const Recorded recorded = channels::RecordedOf(channel);
  if (recorded == Recorded::kNo) return;
  if (channel == channels::kModel) {
    model_info_t model{};
    if (Decode(data, &model)) simulated_time_ = model.clock == clock_name::kLockstep;
    model_.assign(data.begin(), data.end());
    model_time_us_ = receive_time_us;
  }
  if (channel == channels::kEpisodeBegin) OnEpisodeBegin(data);
  if (!events_) return;
  if (recorded == Recorded::kOncePerTick) {
    // Said again, because a slow machine or a lossy network let somebody wait: the log has it.
    if (!IsNews(data, &last_said_[channel])) return;
  }
  header_t header{};
  const bool is_next_state = channel == channels::kState && DecodeHeader<state_t>(data, &header) &&
                             IsOurs(header) && header.tick > status_.last_tick;
  if (is_next_state) time_us_ = header.sim_time_us;
  events_->Write(channel, data, simulated_time_ ? time_us_ : receive_time_us);
  if (is_next_state) {
    status_.missing_ticks += header.tick - status_.last_tick - 1;
    Progress(header);
  } else if (channel == channels::kEpisodeEnd) {
    has_end_ = has_end_ || (DecodeHeader<episode_end_t>(data, &header) && IsOurs(header));
  } else if (channel == channels::kEpisodeSummary) {
    has_summary_ = has_summary_ || (DecodeHeader<episode_summary_t>(data, &header) && IsOurs(header));
  } else if (channel == channels::kRunSummary && close_at_) {
    return CloseEpisode();
  }
  if (has_end_ && has_summary_ && !close_at_) {
    close_at_ = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  }
}

void Recorder::CloseEpisode() {
  const int64_t num_events = events_->num_events();
  events_->Close();
  events_.reset();
  close_at_.reset();
  std::filesystem::rename(UnfinishedEpisodeFolder(run_, status_.episode),
                          EpisodeFolder(run_, status_.episode));
  log().Info("closed and synced {}, {} events", EpisodeLog(run_, status_.episode).string(), num_events);
  status_.last_finished_episode = status_.episode;
  PublishStatus();
}

}  // namespace evalbus
