#include "viz/web/live_feed.h"

#include "base/errors.h"
#include "base/text.h"
#include "bus/message.h"

namespace evalbus::viz {
namespace {

bool IsSame(const header_t& a, const header_t& b) { return a.episode == b.episode && a.attempt == b.attempt; }

}  // namespace

void LiveFeed::Receive(std::string_view channel, std::span<const uint8_t> data, SteadyTime now,
                       const std::string& time) {
  watch_.Receive(channel, data, now);
  if (channel == channels::kModel) {
    if (!UpdateIfChanged(data, &model_bytes_) || watch_.model() == nullptr) return;
    model_ = wanted_ = std::make_shared<const model_info_t>(*watch_.model());
    return;
  }
  if (channel == channels::kLog) {
    const auto add = [&](log_t line) {
      line.component = Printable(line.component);
      line.text = Printable(line.text);
      lines_.push_back({std::move(line), time});
    };
    channels::Dispatch(channel, data, add, channels::kLog);
    return;
  }
  header_t header{};
  if (Enters(channel, data, &header)) {
    episode_ = header;
    begin_was_heard_ = channel == channels::kEpisodeBegin;
    history_is_known_ = begin_was_heard_;
    const bool is_sent = !is_given_ || !track_ ||
                         (given_layout_ == track_->layout() && given_ticks_ == track_->ticks() &&
                          given_over_ == track_->is_over());
    if (!is_sent) finished_ = std::move(track_);
    track_.reset();
    is_given_ = false;
    waiting_.clear();
    waiting_bytes_ = 0;
  }
  const auto add_done = [&](const episode_summary_t& summary) {
    const std::pair<int32_t, int32_t> which(summary.header.episode, summary.header.attempt);
    if (last_done_ == which) return;
    last_done_ = which;
    const bool has_model = watch_.model() != nullptr;
    done_.push_back(
        RowOf(summary, has_model ? watch_.model()->task : "", has_model ? watch_.model()->variation : ""));
  };
  channels::Dispatch(channel, data, add_done, channels::kEpisodeSummary);
  if (!episode_) return;
  if (track_) return Give(channel, data);
  if (waiting_bytes_ + data.size() <= kMaxWaiting) {
    waiting_bytes_ += data.size();
    waiting_.push_back({std::string(channel), {data.begin(), data.end()}});
  }
  BeginTrack();
}

// Returns whether a message begins an episode. The sim publishes EPISODE_BEGIN before the first STATE. If it
// was not received, this process started during the episode, and STATE counts as the beginning.
bool LiveFeed::Enters(std::string_view channel, std::span<const uint8_t> data, header_t* header) const {
  if (channel == channels::kEpisodeBegin) {
    if (!DecodeHeader<episode_begin_t>(data, header)) return false;
    // EPISODE_BEGIN is repeated. After the end of an episode, it means that the same episode restarts (in a
    // replay).
    return !episode_ || !IsSame(*header, *episode_) || (track_ && track_->is_over());
  }
  return channel == channels::kState && DecodeHeader<state_t>(data, header) && IsPlausible(*header) &&
         (!episode_ || !IsSame(*header, *episode_));
}

void LiveFeed::SetScene(const std::shared_ptr<const model_info_t>& model, Scene scene) {
  if (model != wanted_) return;  // a newer MODEL has replaced this one
  scene_ = std::move(scene);
  wanted_.reset();
  BeginTrack();
}

std::optional<header_t> LiveFeed::episode_without_begin() const {
  return episode_ && !history_is_known_ ? episode_ : std::nullopt;
}

void LiveFeed::SetHistory(const header_t& episode, const std::vector<Message>& messages) {
  if (!episode_ || !IsSame(*episode_, episode) || history_is_known_) return;
  history_is_known_ = true;
  waiting_.insert(waiting_.begin(), messages.begin(), messages.end());
  BeginTrack();
}

void LiveFeed::Complete(const header_t& episode, const std::vector<Message>& messages) {
  if (!track_ || !IsSame(track_->episode(), episode)) return;
  for (const Message& message : messages) Give(message.channel, message.data);
}

void LiveFeed::BeginTrack() {
  if (!episode_ || track_ || !model_ || wanted_ || !history_is_known_) return;
  try {
    track_ = std::make_unique<EpisodeTrack>(
        model_, *episode_,
        EpisodeTrack::About{.run = run_, .policy = policy_, .scene = scene_.id, .bodies = scene_.bodies});
  } catch (const InputError&) {
    // RunWatch has already reported the error in this MODEL.
    episode_.reset();
    return;
  }
  is_given_ = false;
  for (const Message& message : std::exchange(waiting_, {})) Give(message.channel, message.data);
  waiting_bytes_ = 0;
}

void LiveFeed::Give(std::string_view channel, std::span<const uint8_t> data) {
  const auto give = [this]<class Message>(const Message& message) {
    if constexpr (std::is_same_v<Message, episode_begin_t>) {
      const bool is_ours = track_->IsOurs(message.header);
      track_->Receive(message, is_ours && scene_.appearance ? scene_.appearance(message.seed) : nullptr);
    } else {
      track_->Receive(message);
    }
  };
  channels::Dispatch(channel, data, give, channels::kEpisodeBegin, channels::kState, channels::kContacts,
                     channels::kPartial, channels::kCriteria, channels::kEpisodeEnd,
                     channels::kEpisodeSummary, channels::kCameraImage);
}

void LiveFeed::Publish(UpdateBroadcaster* broadcaster, const RunLabel& label, const RunNumbers* counted,
                       SteadyTime now) {
  watch_.Update(now);
  if (!lines_.empty()) broadcaster->AddLines(run_, std::exchange(lines_, {}));
  if (now - run_given_ >= kRunPeriod) {
    run_given_ = now;
    broadcaster->SetRun(run_, RunBlock(watch_, label, now, counted));
  }
  PublishEpisode(broadcaster, now);
}

void LiveFeed::PublishEpisode(UpdateBroadcaster* broadcaster, SteadyTime now) {
  if (!broadcaster->is_watched(run_)) {
    // Without viewers, no ticks are published. A new viewer receives the whole episode so far.
    finished_.reset();
    is_given_ = false;
    if (std::exchange(is_published_, false)) broadcaster->ForgetEpisode(run_);
    return;
  }
  if (finished_) {
    // The end of the previous episode is published before the next episode.
    if (now - episode_given_ < kEpisodePeriod) return;
    episode_given_ = now;
    broadcaster->SetEpisode(run_, finished_->EpisodeBlock(), /*is_new=*/true);
    finished_.reset();
    return;
  }
  if (!track_) return;
  const bool is_new = !is_given_ || given_layout_ != track_->layout();
  const bool is_over = track_->is_over();
  const bool may_be_whole = now - episode_given_ >= kEpisodePeriod;
  if (is_new && !may_be_whole) return;
  if (may_be_whole && (is_new || broadcaster->needs_episode(run_))) {
    episode_given_ = now;
    // The episode block contains all ticks so far. Viewers that already have the episode receive only the
    // newest ticks, as a `ticks` block. It must be added first.
    if (!is_new && track_->ticks() > given_ticks_)
      broadcaster->AddTicks(run_, track_->TicksBlock(given_ticks_));
    broadcaster->SetEpisode(run_, track_->EpisodeBlock(), is_new);
  } else if (track_->ticks() > given_ticks_ || is_over != given_over_) {
    broadcaster->AddTicks(run_, track_->TicksBlock(given_ticks_));
  } else {
    return;
  }
  is_given_ = is_published_ = true;
  given_layout_ = track_->layout();
  given_ticks_ = track_->ticks();
  given_over_ = is_over;
}

}  // namespace evalbus::viz
