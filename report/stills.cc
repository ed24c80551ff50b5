#include "report/stills.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/base64.h"
#include "base/errors.h"
#include "bus/episode_reader.h"
#include "results/episode_logs.h"

namespace evalbus::report {
namespace {

constexpr viz::FrameSize kStillSize{480, 360};

// Returns the last state at or before this time; if there is none, the first state.
const state_t& StateAt(const EpisodeMessages& episode, double time_s) {
  const auto time_us = std::llround(time_s * 1e6);
  const auto after = std::ranges::upper_bound(episode.states, time_us, {},
                                              [](const state_t& state) { return state.header.sim_time_us; });
  return after == episode.states.begin() ? *after : *std::prev(after);
}

}  // namespace

StillRenderer::StillRenderer() : scenes_(kStillSize) {}

std::string StillRenderer::DrawMoment(const std::filesystem::path& run, int episode, double time_s) {
  const std::filesystem::path log = results::EpisodeLogs(run, {episode}).front();
  EpisodeReader reader(log, {channels::kState});
  EpisodeMessages messages;
  while (reader.Next(&messages)) {
    if (messages.number() != episode || messages.states.empty() || !messages.model) continue;
    viz::Renderer* const renderer =
        scenes_.Of(*messages.model, log, messages.begin ? std::optional(messages.begin->seed) : std::nullopt);
    renderer->SetState(StateAt(messages, time_s));
    viz::Frame frame(kStillSize);
    renderer->Render(viz::FindCamera(renderer->model(), viz::kDefaultCamera), &frame);
    return "data:image/jpeg;base64," + Base64(encoder_.Encode(frame));
  }
  throw InputError(fmt::format("{}: episode {} is missing, or has no MODEL or STATE", log.string(), episode));
}

}  // namespace evalbus::report
