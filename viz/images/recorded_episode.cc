#include "viz/images/recorded_episode.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>
#include <set>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "lcmtypes/end_reason.h"
#include "models/physics_model.h"

namespace evalbus::viz {
namespace {

// A STATE with a larger time gap to its predecessor counts as damaged; otherwise the video would hold one
// image for hours.
constexpr int64_t kLongestGap_us = 60'000'000;

// Returns whether `begin` starts a different episode. EPISODE_BEGIN is repeated until all components are
// ready.
bool IsAnother(const episode_begin_t& begin, const RecordedEpisode& episode) {
  if (episode.end) return true;
  if (!episode.begin) return !episode.states.empty();
  const header_t& ours = episode.begin->header;
  return begin.header.episode != ours.episode || begin.header.attempt != ours.attempt ||
         begin.seed != episode.begin->seed;
}

// In a realtime run, messages of one channel may have been recorded out of order.
template <class Message>
void SortByTick(std::vector<Message>* messages) {
  std::ranges::stable_sort(*messages, {}, [](const Message& m) { return m.header.tick; });
}

}  // namespace

std::string RecordedEpisode::outcome() const {
  if (summary) return end_reason::Outcome(summary->failure_reason);
  return end ? end->end_reason : "";
}

bool EpisodeReader::Next(RecordedEpisode* episode, const std::function<bool(int)>& is_wanted) {
  *episode = {};
  episode->begin = std::exchange(next_begin_, std::nullopt);
  episode->model = model_;
  const auto add = [&](auto* messages) {
    if (!Decode(event_.data, &messages->emplace_back()) || !is_wanted(messages->back().header.episode)) {
      messages->pop_back();
    }
  };
  while (reader_.Next(&event_)) {
    if (event_.channel == channels::kEpisodeBegin) {
      episode_begin_t begin{};
      if (!Decode(event_.data, &begin)) continue;
      if (IsAnother(begin, *episode)) {
        next_begin_ = begin;
        break;
      }
      episode->begin = begin;
    } else if (event_.channel == channels::kState) {
      if (Decode(event_.data, &state_) && is_wanted(state_.header.episode)) AddState(episode);
    } else if (event_.channel == channels::kPartial) {
      add(&episode->partials);
    } else if (event_.channel == channels::kContacts) {
      add(&episode->contacts);
    } else if (event_.channel == channels::kModel) {
      if (model_info_t model{}; Decode(event_.data, &model)) model_ = std::move(model);
      // A later MODEL is a repetition or belongs to the next run.
      if (!episode->model || episode->states.empty()) episode->model = model_;
    } else if (event_.channel == channels::kEpisodeEnd) {
      if (!Decode(event_.data, &episode->end.emplace())) episode->end.reset();
    } else if (event_.channel == channels::kEpisodeSummary) {
      if (!Decode(event_.data, &episode->summary.emplace())) episode->summary.reset();
    }
  }
  SortByTick(&episode->partials);
  SortByTick(&episode->contacts);
  return episode->begin || !episode->states.empty();
}

void EpisodeReader::AddState(RecordedEpisode* episode) {
  const header_t* ours = episode->begin            ? &episode->begin->header
                         : episode->states.empty() ? nullptr
                                                   : &episode->states[0].header;
  if (ours && (state_.header.episode != ours->episode || state_.header.attempt != ours->attempt)) return;
  const int64_t last = episode->states.empty() ? -1 : episode->states.back().header.sim_time_us;
  // Ignores states that do not advance in time: a repeated tick adds no information.
  if (state_.header.sim_time_us > last && state_.header.sim_time_us <= last + kLongestGap_us) {
    episode->states.push_back(state_);
  }
}

std::vector<int> EpisodesOf(const std::filesystem::path& log) {
  EpisodeReader reader(log);
  std::vector<int> numbers;
  for (RecordedEpisode episode; reader.Next(&episode);) {
    if (!episode.states.empty()) numbers.push_back(episode.number());
  }
  if (reader.log().damaged_places() > 0) {
    std::cerr << "warning: " << log.string() << ": " << reader.log().damaged_bytes()
              << " damaged bytes skipped; the video holds the image where ticks are missing" << std::endl;
  }
  if (!reader.has_model()) throw InputError(log.string() + ": no whole MODEL message in this log");
  if (numbers.empty()) throw InputError(log.string() + ": no whole STATE message in this log");
  return numbers;
}

void CheckEpisodes(const std::filesystem::path& log, const std::vector<int>& numbers,
                   const std::vector<int>& wanted) {
  for (const int number : wanted) {
    if (std::ranges::find(numbers, number) != numbers.end()) continue;
    throw InputError(fmt::format("{} has no episode {}; it has {}", log.string(), number,
                                 fmt::join(std::set(numbers.begin(), numbers.end()), ", ")));
  }
}

ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log) {
  UseModelsIn(RunFolderOf(log), &info);
  return LoadVisualModel(info);
}

}  // namespace evalbus::viz
