#include "viz/pictures/film.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "base/errors.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/host.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/end_reason.h"
#include "models/physics_model.h"
#include "viz/pictures/overlay.h"
#include "viz/pictures/renderer.h"
#include "viz/pictures/video_writer.h"

namespace evalbus::viz {
namespace {

constexpr int64_t kSecond = 1000000;  // us
// A STATE further ahead of the one before is damaged: the film would hold a picture for hours.
constexpr int64_t kLongestGap = 60 * kSecond;

// What a film needs of an episode. Of a log that was cut or damaged, the beginning may be missing.
struct Episode {
  std::optional<model_info_t> model;
  std::optional<episode_begin_t> begin;
  std::vector<state_t> states;
  std::vector<partial_metrics_t> partials;
  std::optional<episode_end_t> end;
  // How it came out, in the tables' word, once it is scored; until then what ended it.
  std::string outcome;

  int number() const { return states.empty() ? begin->header.episode : states[0].header.episode; }
};

// The episodes of a log, one after the other.
class EpisodeReader {
 public:
  explicit EpisodeReader(const std::filesystem::path& log) : reader_(log) {}

  // False where there is none any more. States of an episode that is not wanted are not kept.
  bool Next(
      Episode* episode, const std::function<bool(int)>& is_wanted = [](int) { return true; }) {
    *episode = {};
    episode->begin = std::exchange(next_begin_, std::nullopt);
    episode->model = model_;
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
        if (!Decode(event_.data, &episode->partials.emplace_back())) episode->partials.pop_back();
      } else if (event_.channel == channels::kModel) {
        if (model_info_t model{}; Decode(event_.data, &model)) model_ = std::move(model);
        // Later ones are the same again, or of the run that comes next.
        if (!episode->model || episode->states.empty()) episode->model = model_;
      } else if (event_.channel == channels::kEpisodeEnd) {
        if (!Decode(event_.data, &episode->end.emplace())) episode->end.reset();
        if (episode->end && episode->outcome.empty()) episode->outcome = episode->end->end_reason;
      } else if (event_.channel == channels::kEpisodeSummary) {
        if (episode_summary_t summary{}; Decode(event_.data, &summary)) {
          episode->outcome = end_reason::Outcome(summary.failure_reason);
        }
      }
    }
    // Of a realtime run, scores may have arrived out of order.
    std::stable_sort(episode->partials.begin(), episode->partials.end(),
                     [](const auto& a, const auto& b) { return a.header.tick < b.header.tick; });
    return episode->begin || !episode->states.empty();
  }

  const EventLogReader& log() const { return reader_; }
  bool has_model() const { return model_.has_value(); }

 private:
  // EPISODE_BEGIN is repeated until everybody is ready.
  static bool IsAnother(const episode_begin_t& begin, const Episode& episode) {
    if (episode.end) return true;
    if (!episode.begin) return !episode.states.empty();
    const header_t& ours = episode.begin->header;
    return begin.header.episode != ours.episode || begin.header.attempt != ours.attempt ||
           begin.seed != episode.begin->seed;
  }
  void AddState(Episode* episode) {
    const header_t* ours = episode->begin            ? &episode->begin->header
                           : episode->states.empty() ? nullptr
                                                     : &episode->states[0].header;
    if (ours && (state_.header.episode != ours->episode || state_.header.attempt != ours->attempt)) return;
    const int64_t last = episode->states.empty() ? -1 : episode->states.back().header.sim_time_us;
    // Only forwards: a repeated tick says nothing new.
    if (state_.header.sim_time_us > last && state_.header.sim_time_us <= last + kLongestGap) {
      episode->states.push_back(state_);
    }
  }

  EventLogReader reader_;
  LogEvent event_;
  state_t state_{};
  std::optional<model_info_t> model_;
  std::optional<episode_begin_t> next_begin_;
};

// The model of the run folder that the log is in, wherever the log says that it was; for a log alone, that.
ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log) {
  UseModelsIn(std::filesystem::absolute(log).lexically_normal().parent_path().parent_path().parent_path(),
              &info);
  return LoadVisualModel(info);
}

// Numbers of the episodes that can be filmed.
std::vector<int> EpisodesOf(const std::filesystem::path& log) {
  EpisodeReader reader(log);
  std::vector<int> numbers;
  for (Episode episode; reader.Next(&episode);) {
    if (!episode.states.empty()) numbers.push_back(episode.number());
  }
  if (reader.log().damaged_places() > 0) {
    std::cerr << "warning: " << log.string() << ": " << reader.log().damaged_bytes()
              << " damaged bytes skipped; the film holds the picture where ticks are missing" << std::endl;
  }
  if (!reader.has_model()) throw InputError(log.string() + ": no whole MODEL message in this log");
  if (numbers.empty()) throw InputError(log.string() + ": no whole STATE message in this log");
  return numbers;
}

struct View {
  int camera;
  std::filesystem::path file;
  std::unique_ptr<VideoWriter> video;
};

// Writes the frames of an episode; progress: of this episode.
void Film(const Episode& episode, const std::string& policy, Renderer* renderer, FrameSize size,
          const std::vector<View>& views, const std::function<void(double)>& progress) {
  const Overlay overlay(size);
  Frame frame(size);
  OverlayText text;
  text.title = episode.model->task + "/" + episode.model->variation;
  text.subtitle = EpisodeSubtitle(episode.number());
  text.maker = MakerText(policy, episode.model->robot);

  std::vector<int64_t> sim_time_us;
  for (const state_t& state : episode.states) sim_time_us.push_back(state.header.sim_time_us);
  const std::vector<size_t> schedule = FilmSchedule(sim_time_us);
  const size_t num_frames = schedule.size() + (episode.end ? kFilmHold : 0);
  size_t num_scored = 0, num_filmed = 0;
  const auto film = [&](size_t shown, double time) {
    if (stop_requested()) throw EnvironmentError("stopped; no film is half-written");
    while (num_scored < episode.partials.size() &&
           episode.partials[num_scored].header.tick <= episode.states[shown].header.tick) {
      ++num_scored;
    }
    if (num_scored > 0) AddScores(episode.partials[num_scored - 1].metrics, &text);
    text.time_s = time;
    renderer->SetState(episode.states[shown]);
    for (const View& view : views) {
      renderer->Render(view.camera, &frame);
      overlay.Draw(text, &frame);
      view.video->Write(frame);
    }
    progress(static_cast<double>(++num_filmed) / static_cast<double>(num_frames));
  };
  for (size_t n = 0; n < schedule.size(); ++n) film(schedule[n], static_cast<double>(n) / kFilmRate);
  if (episode.end) {
    text.end_reason = episode.outcome;
    for (int hold = 0; hold < kFilmHold; ++hold) {
      film(episode.states.size() - 1, static_cast<double>(sim_time_us.back()) / kSecond);
    }
  }
}

}  // namespace

std::string FilmName(std::string camera) {
  std::replace(camera.begin(), camera.end(), '/', '_');
  return camera + ".mp4";
}

void CheckCameras(const mjModel& model, const std::vector<std::string>& cameras) {
  std::set<std::string> films;
  for (const std::string& camera : cameras) {
    FindCamera(model, camera);
    if (!films.insert(FilmName(camera)).second) {
      throw InputError("camera '" + camera + "' is there twice, or another makes the same " +
                       FilmName(camera));
    }
  }
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

std::vector<std::filesystem::path> FilmLog(const std::filesystem::path& log,
                                           const std::vector<std::string>& cameras, FrameSize size,
                                           const std::filesystem::path& folder, const FilmOptions& options) {
  const std::vector<int> numbers = EpisodesOf(log);
  const auto is_wanted = [&](int number) {
    return options.episodes.empty() || std::ranges::find(options.episodes, number) != options.episodes.end();
  };
  for (const int number : options.episodes) {
    if (std::ranges::find(numbers, number) != numbers.end()) continue;
    throw InputError(fmt::format("{} has no episode {}; it has {}", log.string(), number,
                                 fmt::join(std::set(numbers.begin(), numbers.end()), ", ")));
  }
  const auto wanted = static_cast<double>(std::ranges::count_if(numbers, is_wanted));
  std::vector<std::filesystem::path> files;
  std::map<int, int> times;
  double done = 0;
  EpisodeReader reader(log);
  std::string model_sha256;
  std::optional<Renderer> renderer;
  for (Episode episode; reader.Next(&episode, is_wanted);) {
    if (episode.states.empty()) continue;
    const int number = episode.number();
    if (!episode.model) throw InputError(log.string() + ": no whole MODEL message before the first STATE");
    if (!renderer || episode.model->visual_sha256 != model_sha256) {
      renderer.emplace(VisualModel(*episode.model, log), size);
      model_sha256 = episode.model->visual_sha256;
      CheckCameras(renderer->model(), cameras);
    }
    renderer->SetAppearance(*episode.model,
                            episode.begin ? std::optional(episode.begin->seed) : std::nullopt);
    std::string before;
    if (numbers.size() > 1) {
      before = fmt::format("episode_{:04}_", number);
      if (const int n = ++times[number]; n > 1) before += fmt::format("{}_", n);
    }
    std::vector<View> views;
    for (const std::string& camera : cameras) {
      views.push_back({FindCamera(renderer->model(), camera), folder / (before + FilmName(camera)), nullptr});
    }
    for (View& view : views) view.video = std::make_unique<VideoWriter>(view.file, size, kFilmRate);
    Film(episode, options.policy, &*renderer, size, views, [&](double share) {
      if (options.progress) options.progress((done + share) / wanted);
    });
    for (View& view : views) {
      view.video->Close();
      files.push_back(view.file);
    }
    ++done;
  }
  return files;
}

}  // namespace evalbus::viz
