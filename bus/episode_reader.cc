#include "bus/episode_reader.h"

#include <algorithm>
#include <utility>

#include "base/overloaded.h"
#include "lcmtypes/end_reason.h"

namespace evalbus {
namespace {

constexpr int64_t kLongestStateGap_us = 60'000'000;

bool IsOurs(const header_t& header, const EpisodeMessages& episode) {
  return header.episode == episode.first_header.episode && header.attempt == episode.first_header.attempt;
}

bool IsAnother(const episode_begin_t& begin, const EpisodeMessages& episode, bool has_tick) {
  if (episode.end) return true;
  if (!episode.begin) return has_tick;
  return !IsOurs(begin.header, episode) || begin.seed != episode.begin->seed;
}

template <class Message>
void KeepFirstOfEachTick(std::vector<Message>* messages) {
  const auto tick = [](const Message& message) { return message.header.tick; };
  if (!std::ranges::is_sorted(*messages, {}, tick)) std::ranges::stable_sort(*messages, {}, tick);
  const auto is_repeated = [&](const Message& a, const Message& b) { return tick(a) == tick(b); };
  messages->erase(std::unique(messages->begin(), messages->end(), is_repeated), messages->end());
}

void RemoveDamagedTimes(std::vector<state_t>* states) {
  int64_t last_us = -1;
  std::erase_if(*states, [&](const state_t& state) {
    const int64_t time_us = state.header.sim_time_us;
    if (time_us <= last_us || time_us > last_us + kLongestStateGap_us) return true;
    last_us = time_us;
    return false;
  });
}

}  // namespace

std::string EpisodeMessages::outcome() const {
  if (summary) return end_reason::Outcome(summary->failure_reason);
  return end ? end_reason::Text(end->end_reason) : "";
}

std::string EpisodeReader::WhyNotWhole(const EpisodeMessages* episode) const {
  if (reader_.damaged_places() > 0)
    return "damaged: " + std::to_string(reader_.damaged_bytes()) + " bytes cannot be read";
  if (!episode || !episode->model || !episode->begin)
    return "no episode in this log (MODEL and EPISODE_BEGIN)";
  if (!episode->end || !episode->summary)
    return "the end of the episode is missing (EPISODE_END, EPISODE_SUMMARY)";
  return "";
}

template <class Message>
void EpisodeReader::Add(const Channel<Message>& channel, const std::function<bool(int)>& is_wanted,
                        std::vector<Message>* messages, EpisodeMessages* episode) {
  header_t header{};
  if (channel != event_.channel || !DecodeHeader<Message>(event_.data, &header) || !IsPlausible(header)) {
    return;
  }
  if (!episode->begin && !has_tick_) episode->first_header = header;
  has_tick_ = true;
  if (!IsOurs(header, *episode)) return;
  if (!channels_.contains(event_.channel) || !is_wanted(header.episode)) return;
  if (!Decode(event_.data, &messages->emplace_back())) messages->pop_back();
}

bool EpisodeReader::Next(EpisodeMessages* episode, const std::function<bool(int)>& is_wanted) {
  *episode = {};
  has_tick_ = false;
  const auto begin_with = [&](episode_begin_t begin) {
    episode->first_header = begin.header;
    episode->begin = std::move(begin);
  };
  const auto has_begun = [&] { return episode->begin || has_tick_; };
  const auto others = Overloaded{
      [&](episode_begin_t begin) {
        if (IsAnother(begin, *episode, has_tick_)) {
          next_begin_ = std::move(begin);
        } else {
          begin_with(std::move(begin));
        }
      },
      [&](model_info_t model) {
        model_ = std::move(model);
        if (!episode->model || !has_tick_) episode->model = model_;
      },
      [&](episode_end_t end) {
        if (has_begun() && IsOurs(end.header, *episode)) episode->end = std::move(end);
      },
      [&](episode_summary_t summary) {
        if (has_begun() && IsOurs(summary.header, *episode)) episode->summary = std::move(summary);
      },
  };
  if (next_begin_) begin_with(*std::exchange(next_begin_, std::nullopt));
  episode->model = model_;
  while (!next_begin_ && reader_.Next(&event_)) {
    Add(channels::kState, is_wanted, &episode->states, episode);
    Add(channels::kContacts, is_wanted, &episode->contacts, episode);
    Add(channels::kAction, is_wanted, &episode->actions, episode);
    Add(channels::kPartial, is_wanted, &episode->partials, episode);
    channels::Dispatch(event_.channel, event_.data, others, channels::kEpisodeBegin, channels::kModel,
                       channels::kEpisodeEnd, channels::kEpisodeSummary);
  }
  KeepFirstOfEachTick(&episode->states);
  KeepFirstOfEachTick(&episode->contacts);
  KeepFirstOfEachTick(&episode->actions);
  KeepFirstOfEachTick(&episode->partials);
  RemoveDamagedTimes(&episode->states);
  return has_begun();
}

}  // namespace evalbus
