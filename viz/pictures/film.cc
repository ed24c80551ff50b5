#include "viz/pictures/film.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/host.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/physics_model.h"
#include "viz/pictures/overlay.h"
#include "viz/pictures/renderer.h"
#include "viz/pictures/video_writer.h"

namespace evalbus::viz {
namespace {

constexpr int64_t kSecond = 1000000;  // us
// A STATE further ahead of the one before is damaged: the film would hold a picture for hours.
constexpr int64_t kLongestGap = 60 * kSecond;

// What a film needs of a log.
struct Episode {
  std::optional<model_info_t> model;
  std::optional<episode_begin_t> begin;
  std::vector<state_t> states;
  std::vector<partial_metrics_t> partials;
  std::optional<episode_end_t> end;
};

Episode ReadEpisode(const std::filesystem::path& log) {
  Episode episode;
  EventLogReader reader(log);
  LogEvent event;
  const auto decode = [&event](auto* message) { return Decode(event.data, message); };
  state_t state{};
  while (reader.Next(&event)) {
    if (event.channel == channels::kState) {
      if (!decode(&state)) continue;
      const int64_t last = episode.states.empty() ? -1 : episode.states.back().header.sim_time_us;
      // Only forwards: a repeated tick says nothing new.
      if (state.header.sim_time_us > last && state.header.sim_time_us <= last + kLongestGap) {
        episode.states.push_back(state);
      }
    } else if (event.channel == channels::kPartial) {
      if (!decode(&episode.partials.emplace_back())) episode.partials.pop_back();
    } else if (event.channel == channels::kModel) {
      if (!decode(&episode.model.emplace())) episode.model.reset();
    } else if (event.channel == channels::kEpisodeBegin) {
      if (!decode(&episode.begin.emplace())) episode.begin.reset();
    } else if (event.channel == channels::kEpisodeEnd) {
      if (!decode(&episode.end.emplace())) episode.end.reset();
    }
  }
  if (reader.damaged_places() > 0) {
    std::cerr << "warning: " << log.string() << ": " << reader.damaged_bytes()
              << " damaged bytes skipped; the film holds the picture where ticks are missing" << std::endl;
  }
  if (!episode.model) throw InputError(log.string() + ": no whole MODEL message in this log");
  if (episode.states.empty()) throw InputError(log.string() + ": no whole STATE message in this log");
  // Of a realtime run, scores may have arrived out of order.
  std::stable_sort(episode.partials.begin(), episode.partials.end(),
                   [](const auto& a, const auto& b) { return a.header.tick < b.header.tick; });
  return episode;
}

// The model of the run folder that the log is in, wherever the log says that it was; for a log alone, that.
ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log) {
  const auto run =
      std::filesystem::absolute(log).lexically_normal().parent_path().parent_path().parent_path();
  const auto own = run / kModelFolder / kVisualModel;
  if (std::filesystem::exists(own)) info.visual_file = own.string();
  return LoadVisualModel(info);
}

OverlayText Describe(const Episode& episode) {
  OverlayText text;
  text.title = episode.model->task + "/" + episode.model->variation;
  text.subtitle = EpisodeSubtitle(episode.states[0].header.episode,
                                  episode.begin ? std::optional(episode.begin->seed) : std::nullopt);
  return text;
}

}  // namespace

std::string FilmName(std::string camera) {
  std::replace(camera.begin(), camera.end(), '/', '_');
  return camera + ".mp4";
}

std::vector<size_t> FilmSchedule(const std::vector<int64_t>& sim_time_us) {
  std::vector<size_t> shown;
  size_t i = 0;
  // In whole numbers, so that no frame is off by one: n / 30 s against microseconds.
  for (int64_t n = 0; !sim_time_us.empty() && n * kSecond <= sim_time_us.back() * kFilmRate; ++n) {
    while (i + 1 < sim_time_us.size() && sim_time_us[i + 1] * kFilmRate <= n * kSecond) ++i;
    shown.push_back(i);
  }
  return shown;
}

std::vector<std::filesystem::path> FilmEpisode(const std::filesystem::path& log,
                                               const std::vector<std::string>& cameras, FrameSize size,
                                               const std::filesystem::path& folder) {
  const Episode episode = ReadEpisode(log);
  Renderer renderer(VisualModel(*episode.model, log), size);
  const Overlay overlay(size);
  Frame frame(size);
  OverlayText text = Describe(episode);

  struct View {
    int camera;
    std::filesystem::path file;
    std::unique_ptr<VideoWriter> video;
  };
  std::vector<View> views;
  for (const std::string& camera : cameras) {
    views.push_back({FindCamera(renderer.model(), camera), folder / FilmName(camera), nullptr});
  }
  for (View& view : views) view.video = std::make_unique<VideoWriter>(view.file, size, kFilmRate);

  size_t num_scored = 0;
  const auto film = [&](size_t shown, double time) {
    if (stop_requested()) throw EnvironmentError("stopped; no film is half-written");
    while (num_scored < episode.partials.size() &&
           episode.partials[num_scored].header.tick <= episode.states[shown].header.tick) {
      ++num_scored;
    }
    if (num_scored > 0) AddScores(episode.partials[num_scored - 1].metrics, &text);
    text.time_s = time;
    renderer.SetState(episode.states[shown]);
    for (View& view : views) {
      renderer.Render(view.camera, &frame);
      overlay.Draw(text, &frame);
      view.video->Write(frame);
    }
  };
  std::vector<int64_t> sim_time_us;
  for (const state_t& state : episode.states) sim_time_us.push_back(state.header.sim_time_us);
  int64_t n = 0;
  for (const size_t shown : FilmSchedule(sim_time_us)) {
    film(shown, static_cast<double>(n++) / kFilmRate);
  }
  if (episode.end) {
    text.end_reason = episode.end->end_reason;
    for (int hold = 0; hold < kFilmHold; ++hold) {
      film(episode.states.size() - 1, static_cast<double>(sim_time_us.back()) / kSecond);
    }
  }
  std::vector<std::filesystem::path> files;
  for (View& view : views) {
    view.video->Close();
    files.push_back(view.file);
  }
  return files;
}

}  // namespace evalbus::viz
