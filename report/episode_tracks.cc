#include "report/episode_tracks.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "lcmtypes/source.h"
#include "metrics/episode/criteria_pace.h"
#include "metrics/statistics/run_statistics.h"
#include "models/physics_model.h"
#include "results/no_return.h"
#include "results/rescorer.h"

namespace evalbus::report {

const viz::SceneBlocks& Scenes::Of(model_info_t model, const std::filesystem::path& run) {
  UseModelsIn(run, &model);
  // The hashes do not cover the robot's name and the variation, because MODEL contains them, not the model
  // files.
  const std::string key = model.visual_sha256 + model.physics_sha256 + model.robot + model.variation;
  Entry& entry = [&]() -> Entry& {
    const std::lock_guard lock(mutex_);
    return scenes_[key];
  }();
  const std::lock_guard building(entry.mutex);
  if (!entry.scene) {
    entry.scene = std::make_unique<viz::SceneBlocks>(model);
    const std::lock_guard lock(mutex_);
    for (const auto& [id, bytes] : entry.scene->blocks()) {
      Block& block = blocks_[id];
      if (!block) block = std::make_shared<const std::string>(bytes);
    }
  }
  return *entry.scene;
}

std::map<std::string, Scenes::Block> Scenes::blocks() const {
  const std::lock_guard lock(mutex_);
  return blocks_;
}

Scenes::Block Scenes::FindBlock(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = blocks_.find(id);
  return found == blocks_.end() ? nullptr : found->second;
}

namespace {

// Adds the images of an external source's cameras. header_of: converts an image's header to the matching
// header in the track.
template <class HeaderOf>
void ReceiveImages(const std::filesystem::path& log, const HeaderOf& header_of, viz::EpisodeTrack* track) {
  EventLogReader reader(log);
  for (LogEvent event; reader.Next(&event);) {
    if (!channels::Carries(channels::kCameraImage, event.channel)) continue;
    image_t image{};
    if (!Decode(event.data, &image)) continue;
    image.header = header_of(image.header);
    track->Receive(image);
  }
}

}  // namespace

std::unique_ptr<viz::EpisodeTrack> TrackEpisode(const std::filesystem::path& log,
                                                viz::EpisodeTrack::About about, Scenes* scenes) {
  std::unique_ptr<viz::EpisodeTrack> track;
  partial_metrics_t partial{};
  criteria_t criteria{};
  metrics::CriteriaPace criteria_pace;
  results::Rescorer rescorer;
  rescorer.OnBegin([&](const std::shared_ptr<const model_info_t>& model, const episode_begin_t& begin) {
    nlohmann::ordered_json appearance;
    if (scenes) {
      const viz::SceneBlocks& scene = scenes->Of(*model, RunFolderOf(log));
      about.scene = scene.id();
      about.bodies = scene.moving_bodies();
      appearance = scene.Appearance(begin.seed);
    }
    track = std::make_unique<viz::EpisodeTrack>(model, begin.header, about);
    track->Receive(begin, std::move(appearance));
    criteria = {};
    criteria_pace.Start();
  });
  rescorer.OnTick(
      [&](const metrics::EpisodeScorer& scorer, const state_t& state, const contacts_t& contacts) {
        track->Receive(state);
        track->Receive(contacts);
        scorer.Partial(&partial);
        track->Receive(partial);
        scorer.Criteria(&criteria);
        if (criteria_pace.IsDue(partial.header, partial.verdict)) track->Receive(criteria);
      });
  const results::RescoredLog scores = rescorer.Rescore(log);
  if (scores.episodes.empty()) throw InputError(log.string() + ": no episode in this log");
  if (track->model().source != source_name::kSim) ReceiveImages(log, std::identity(), track.get());
  track->Receive(criteria);
  track->Receive(scores.episodes.back().summary);
  const results::NoReturns points = results::ReadNoReturns(RunFolderOf(log));
  const auto point = points.find(track->episode().episode);
  if (point != points.end() && point->second.has_point())
    track->AddNoReturn(point->second.tick, results::NoReturnText(point->second));
  return track;
}

std::unique_ptr<viz::EpisodeTrack> BlindTrack(const std::filesystem::path& log, int number, Scenes* scenes) {
  std::unique_ptr<viz::EpisodeTrack> track;
  const auto renumbered = [number](header_t header) {
    header.episode = number;
    header.attempt = 0;
    return header;
  };
  episode_end_t end{};
  results::Rescorer rescorer;
  rescorer.OnBegin([&](const std::shared_ptr<const model_info_t>& model, const episode_begin_t& begin) {
    const viz::SceneBlocks& scene = scenes->Of(*model, RunFolderOf(log));
    episode_begin_t blind{};
    blind.header = renumbered(begin.header);
    track = std::make_unique<viz::EpisodeTrack>(
        model, blind.header, viz::EpisodeTrack::About{.scene = scene.id(), .bodies = scene.moving_bodies()});
    track->Receive(blind, scene.Appearance(begin.seed));
  });
  rescorer.OnTick([&](const metrics::EpisodeScorer& scorer, const state_t& state, const contacts_t&) {
    state_t blind = state;
    blind.header = end.header = renumbered(state.header);
    track->Receive(blind);
    if (state.header.tick > 0) return;
    // The score at tick 0 contains the names of the stages.
    partial_metrics_t start{};
    scorer.Partial(&start);
    start.header = blind.header;
    track->Receive(start);
  });
  if (rescorer.Rescore(log).episodes.empty()) throw InputError(log.string() + ": no episode in this log");
  if (track->model().source != source_name::kSim) ReceiveImages(log, renumbered, track.get());
  track->Receive(end);
  return track;
}

viz::RunNumbers NumbersOf(const results::RecordedRun& run, int planned, const metrics::RunSummary& summary,
                          bool is_over) {
  const metrics::Interval& interval = is_over ? summary.wilson : summary.anytime;
  return {.task = run.task,
          .variation = run.variation,
          .clock = run.clock(),
          .planned = planned,
          .done = summary.episodes,
          .complete = summary.complete,
          .judged = summary.judged,
          .successes = summary.successes,
          .lower = interval.lower,
          .upper = interval.upper,
          .is_over = is_over,
          .failure_reasons = {summary.failure_reasons.begin(), summary.failure_reasons.end()}};
}

std::string RunBlock(const results::RecordedRun& run, int number) {
  return viz::RunBlock(
      NumbersOf(run, run.num_planned(), run.Statistics().Summary(false), true),
      {.run = number, .name = run.name, .policy = run.policy, .is_live = false, .remarks = run.Remarks()});
}

viz::EpisodeRow RowOf(const results::RecordedEpisode& episode, const results::RecordedRun& run) {
  viz::EpisodeRow row;
  row.episode = episode.episode;
  row.seed = episode.seed;
  row.task = run.task;
  row.variation = run.variation;
  row.end_reason = episode.end_reason;
  row.failure_reason = episode.failure_reason;
  row.success = episode.success;
  row.complete = episode.complete;
  row.time = episode.completion_time;
  row.text = episode.explanation;
  row.cause_time = episode.cause.time_s;
  row.cause_text = episode.cause.text;
  for (const auto& [name, value] : episode.values) {
    const auto add = [&, number = value](std::optional<int64_t>* sum) {
      if (std::isfinite(number)) *sum = sum->value_or(0) + std::llround(number);
    };
    if (name == "slip_count") add(&row.slips);
    if (name.starts_with("extended.grasp_count")) add(&row.grasps);
    if (name == "env_collision_count" || name == "self_collision_count") add(&row.collisions);
  }
  for (const auto& [index, is_reached] : episode.stages)
    row.stages = row.stages.value_or(0) + (is_reached ? 1 : 0);
  row.has_track = std::filesystem::exists(EpisodeLog(run.folder, episode.episode));
  return row;
}

std::vector<viz::EpisodeRow> EpisodeRows(const results::RecordedRun& run) {
  std::vector<viz::EpisodeRow> rows;
  for (const results::RecordedEpisode& episode : run.episodes) rows.push_back(RowOf(episode, run));
  return rows;
}

}  // namespace evalbus::report
