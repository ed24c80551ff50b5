#include "viz/pictures/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "base/errors.h"
#include "bus/host.h"
#include "viz/pictures/overlay.h"
#include "viz/pictures/panel_film.h"
#include "viz/pictures/recorded_episode.h"
#include "viz/pictures/renderer.h"
#include "viz/pictures/video_writer.h"

namespace evalbus::viz {
namespace {

constexpr int64_t kSecond = 1000000;  // us

struct View {
  int camera;
  std::filesystem::path file;
  std::unique_ptr<VideoWriter> video;
};

// Writes the frames of an episode; progress: of this episode.
void Film(const RecordedEpisode& episode, const std::string& policy, Renderer* renderer, FrameSize size,
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
  // Into so many frames.
  const auto film = [&](size_t shown, double time, int times) {
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
      for (int i = 0; i < times; ++i) view.video->Write(frame);
    }
    num_filmed += static_cast<size_t>(times);
    progress(static_cast<double>(num_filmed) / static_cast<double>(num_frames));
  };
  for (size_t n = 0; n < schedule.size(); ++n) film(schedule[n], static_cast<double>(n) / kFilmRate, 1);
  if (episode.end) {
    text.end_reason = episode.outcome();
    film(episode.states.size() - 1, static_cast<double>(sim_time_us.back()) / kSecond, kFilmHold);
  }
}

}  // namespace

FilmLayout ParseFilmLayout(const std::string& name) {
  if (name == "plain") return FilmLayout::kPlain;
  if (name == kFullLayout) return FilmLayout::kFull;
  throw InputError("--layout " + name + ": there are plain and full");
}

std::string FilmName(std::string camera, const std::string& ending) {
  std::replace(camera.begin(), camera.end(), '/', '_');
  return camera + ending;
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
  CheckEpisodes(log, numbers, options.episodes);
  if (!options.file.empty()) {
    const auto films = std::ranges::count_if(numbers, is_wanted) *
                       (options.layout == FilmLayout::kFull ? 1 : static_cast<ptrdiff_t>(cameras.size()));
    if (films != 1) {
      throw InputError(fmt::format("{} films do not go into one file: {}", films, options.file.string()));
    }
  }
  const auto wanted = static_cast<double>(std::ranges::count_if(numbers, is_wanted));
  std::vector<std::filesystem::path> files;
  std::map<int, int> times;
  double done = 0;
  EpisodeReader reader(log);
  std::string model_sha256;
  std::optional<Renderer> renderer;
  for (RecordedEpisode episode; reader.Next(&episode, is_wanted);) {
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
    const auto progress = [&](double share) {
      if (options.progress) options.progress((done + share) / wanted);
    };
    const auto file = [&](const std::string& what) {
      return options.file.empty() ? folder / (before + FilmName(what, options.ending)) : options.file;
    };
    if (options.layout == FilmLayout::kFull) {
      files.push_back(file(kFullLayout));
      FilmFull(ToFilm(episode, options.policy, log), &*renderer,
               cameras.empty() ? FullCameras(renderer->model()) : cameras, size, files.back(), progress);
      ++done;
      continue;
    }
    std::vector<View> views;
    for (const std::string& camera : cameras) {
      views.push_back({FindCamera(renderer->model(), camera), file(camera), nullptr});
    }
    for (View& view : views) view.video = std::make_unique<VideoWriter>(view.file, size, kFilmRate);
    Film(episode, options.policy, &*renderer, size, views, progress);
    for (View& view : views) {
      view.video->Close();
      files.push_back(view.file);
    }
    ++done;
  }
  return files;
}

}  // namespace evalbus::viz
