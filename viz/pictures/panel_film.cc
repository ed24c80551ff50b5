#include "viz/pictures/panel_film.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "base/errors.h"
#include "base/text.h"
#include "bus/host.h"
#include "models/task_description.h"
#include "viz/pictures/film.h"
#include "viz/pictures/film_panels.h"
#include "viz/pictures/overlay.h"
#include "viz/pictures/video_writer.h"

namespace evalbus::viz {
namespace {

double TimeOf(size_t frame) { return static_cast<double>(frame) / kFilmRate; }

FrameSize SizeOf(const Box& box) { return {static_cast<int>(box.width), static_cast<int>(box.height)}; }

// What a camera sees, drawn into a box of a frame.
class Shots {
 public:
  void Draw(Renderer* renderer, int camera, const Box& box, Frame* frame) {
    const FrameSize size = SizeOf(box);
    renderer->RenderRgb({.camera = camera, .size = size}, &rgb_);
    for (size_t row = 0; row < static_cast<size_t>(size.height); ++row) {
      const uint8_t* from = &rgb_[row * static_cast<size_t>(size.width) * 3];
      uint8_t* to =
          &frame->bgrx[((static_cast<size_t>(box.y) + row) * static_cast<size_t>(frame->size.width) +
                        static_cast<size_t>(box.x)) *
                       4];
      for (int i = 0; i < size.width; ++i, from += 3, to += 4) {
        to[0] = from[2];
        to[1] = from[1];
        to[2] = from[0];
      }
    }
  }

 private:
  std::vector<uint8_t> rgb_;
};

std::vector<FilmPanels::Place> PlacesOf(const FilmedEpisode& episode, size_t frame, const Renderer& renderer,
                                        int camera, const Box& box) {
  std::vector<FilmPanels::Place> places;
  const CameraPose pose = renderer.PoseOf(camera);
  for (const PlaceMark& mark : episode.facts.places[frame]) {
    if (const auto point = Project(pose, SizeOf(box), mark.position_m)) places.push_back({mark.kind, *point});
  }
  return places;
}

void CheckStop() {
  if (stop_requested()) throw EnvironmentError("stopped; no film is half-written");
}

// A renderer for each scene. Where a task draws colours, lights or cameras, each episode has its own.
class FilmScenes {
 public:
  explicit FilmScenes(FrameSize largest) : largest_(largest) {}

  Renderer* Of(const FilmedEpisode& episode) {
    Scene& scene = scenes_[episode.model.visual_sha256];
    if (!scene.renderer) {
      scene.renderer = std::make_unique<Renderer>(VisualModel(episode.model, episode.log), largest_);
      const TaskDescription task = ParseTask(episode.model.task_yaml, episode.model.task_file, false);
      scene.varies = !task.variation(episode.model.variation).appearance.empty();
    }
    if (scene.varies && scene.shown != &episode) {
      scene.renderer->SetAppearance(episode.model, episode.seed);
      scene.shown = &episode;
    }
    return scene.renderer.get();
  }

 private:
  struct Scene {
    std::unique_ptr<Renderer> renderer;
    bool varies = false;
    const FilmedEpisode* shown = nullptr;
  };
  FrameSize largest_;
  std::map<std::string, Scene> scenes_;
};

size_t LongestOf(const std::vector<FilmedEpisode>& episodes) {
  size_t frames = 0;
  for (const FilmedEpisode& episode : episodes) frames = std::max(frames, episode.states.size());
  return frames;
}

std::string ClockText(double time_s) { return fmt::format("{:.2f} s", time_s); }

}  // namespace

FilmedEpisode ToFilm(const RecordedEpisode& episode, const std::string& policy,
                     const std::filesystem::path& log) {
  std::vector<int64_t> sim_time_us;
  for (const state_t& state : episode.states) sim_time_us.push_back(state.header.sim_time_us);
  const std::vector<size_t> schedule = FilmSchedule(sim_time_us);
  FilmedEpisode filmed;
  filmed.log = log;
  filmed.model = *episode.model;
  if (episode.begin) filmed.seed = episode.begin->seed;
  filmed.facts = FactsOf(episode, schedule, policy);
  for (const size_t shown : schedule) filmed.states.push_back(episode.states[shown]);
  return filmed;
}

std::vector<FilmedEpisode> ReadEpisodesToFilm(const std::filesystem::path& log,
                                              const std::vector<int>& episodes, const std::string& policy) {
  const std::vector<int> numbers = EpisodesOf(log);
  CheckEpisodes(log, numbers, episodes);
  const auto is_wanted = [&](int number) {
    return episodes.empty() || std::ranges::find(episodes, number) != episodes.end();
  };
  std::vector<FilmedEpisode> filmed;
  EpisodeReader reader(log);
  for (RecordedEpisode episode; reader.Next(&episode, is_wanted);) {
    if (episode.states.empty()) continue;
    if (!episode.model) throw InputError(log.string() + ": no whole MODEL message before the first STATE");
    filmed.push_back(ToFilm(episode, policy, log));
  }
  return filmed;
}

std::vector<std::string> FullCameras(const mjModel& model) {
  std::vector<std::string> cameras = {kDefaultCamera};
  const auto add = [&](const std::function<bool(const std::string&)>& is_wanted) {
    for (int i = 0; i < model.ncam; ++i) {
      const char* name = mj_id2name(&model, mjOBJ_CAMERA, i);
      if (name && is_wanted(name) && cameras.size() <= kMostInsets) cameras.push_back(name);
    }
  };
  add([](const std::string& name) { return name == "head"; });
  add([](const std::string& name) { return name.ends_with("/wrist"); });
  return cameras;
}

void FilmFull(const FilmedEpisode& episode, Renderer* renderer, const std::vector<std::string>& cameras,
              FrameSize size, const std::filesystem::path& file, const FilmProgress& progress) {
  CheckPanelSize(size);
  if (cameras.size() > kMostInsets + 1) {
    throw InputError(
        fmt::format("the full layout shows {} cameras at most, the first one large; these are {}",
                    kMostInsets + 1, cameras.size()));
  }
  std::vector<int> ids;
  for (const std::string& camera : cameras) ids.push_back(FindCamera(renderer->model(), camera));
  const FilmFacts& facts = episode.facts;
  const FullLayout layout =
      LayOutFull(size, static_cast<int>(cameras.size()) - 1, static_cast<int>(facts.curves.size()));
  const std::string subtitle = facts.maker + ", " + EpisodeSubtitle(facts.episode);
  Frame frame(size);
  FilmPanels panels(&frame, layout.scale);
  Shots shots;
  VideoWriter video(file, size, kFilmRate);
  const bool has_end = EndOf(facts) != FilmEnd::kNone;
  const double total = static_cast<double>(episode.states.size()) + (has_end ? kPanelHold : 0);
  const auto draw = [&](size_t n, double time) {
    CheckStop();
    panels.Page();
    panels.Header(layout.header, facts.task, subtitle, ClockText(time));
    renderer->SetState(episode.states[n]);
    for (size_t i = 0; i < ids.size(); ++i) {
      const Box& box = i == 0 ? layout.main : layout.insets[i - 1];
      shots.Draw(renderer, ids[i], box, &frame);
      panels.Places(box, PlacesOf(episode, n, *renderer, ids[i], box), i == 0);
      if (i > 0) panels.Caption(box, Printable(cameras[i]));
    }
    panels.Stages(layout.stages, facts, time);
    for (size_t i = 0; i < layout.curves.size(); ++i) {
      panels.Curve(layout.curves[i], facts, facts.curves[i], time, facts.duration_s, facts.curves[i].highest);
    }
    panels.TimeLine(layout.time_line, facts, time, facts.duration_s);
  };
  for (size_t n = 0; n < episode.states.size(); ++n) {
    draw(n, TimeOf(n));
    video.Write(frame);
    progress(static_cast<double>(n + 1) / total);
  }
  if (has_end) {
    draw(episode.states.size() - 1, facts.duration_s);
    panels.EndCard(layout.main, facts);
    for (int hold = 0; hold < kPanelHold; ++hold) video.Write(frame);
    progress(1);
  }
  video.Close();
}

void FilmPair(const std::vector<FilmedEpisode>& episodes, const JointFilmOptions& options,
              const std::filesystem::path& file) {
  CheckPanelSize(options.size);
  const PairLayout layout = LayOutPair(options.size);
  FilmScenes scenes(options.size);
  Frame frame(options.size);
  FilmPanels panels(&frame, layout.scale);
  Shots shots;
  for (const FilmedEpisode& episode : episodes) FindCamera(scenes.Of(episode)->model(), options.camera);
  // The same axes on both sides.
  double to_s = 0;
  for (const FilmedEpisode& episode : episodes) to_s = std::max(to_s, episode.facts.duration_s);
  const auto highest = [&](const std::string& label) {
    double most = 0;
    for (const FilmedEpisode& episode : episodes) {
      for (const FilmCurve& curve : episode.facts.curves) {
        if (curve.label == label) most = std::max(most, curve.highest);
      }
    }
    return most;
  };
  VideoWriter video(file, options.size, kFilmRate);
  const size_t longest = LongestOf(episodes);
  for (size_t n = 0; n <= longest; ++n) {
    CheckStop();
    panels.Page();
    const double time = n < longest ? TimeOf(n) : to_s;
    panels.Header(layout.header, options.title, options.subtitle, ClockText(time));
    for (size_t i = 0; i < episodes.size(); ++i) {
      const FilmedEpisode& episode = episodes[i];
      const PairLayout::Side& side = layout.side[i];
      const FilmFacts& facts = episode.facts;
      const bool is_over = n >= episode.states.size();
      const size_t shown = std::min(n, episode.states.size() - 1);
      const double own_time = is_over ? facts.duration_s : time;
      Renderer* const renderer = scenes.Of(episode);
      const int camera = FindCamera(renderer->model(), options.camera);
      panels.Title(side.title, facts, episode.name, is_over);
      renderer->SetState(episode.states[shown]);
      shots.Draw(renderer, camera, side.picture, &frame);
      panels.Places(side.picture, PlacesOf(episode, shown, *renderer, camera, side.picture), true);
      panels.Stages(side.stages, facts, own_time);
      if (!facts.curves.empty()) {
        const FilmCurve& curve = facts.curves[0];
        panels.Curve(side.curve, facts, curve, own_time, to_s, highest(curve.label));
      }
      panels.TimeLine(side.time_line, facts, own_time, to_s);
      if (is_over) panels.EndCard(side.picture, facts);
    }
    for (int i = 0; i < (n < longest ? 1 : kPanelHold); ++i) video.Write(frame);
    if (options.progress) options.progress(static_cast<double>(n + 1) / static_cast<double>(longest + 1));
  }
  video.Close();
}

void FilmGrid(const std::vector<FilmedEpisode>& episodes, const JointFilmOptions& options,
              const std::filesystem::path& file) {
  CheckPanelSize(options.size);
  const GridLayout layout = LayOutGrid(options.size, options.shape.columns, options.shape.rows);
  const auto picture = [&](size_t i) {
    const Box& cell = layout.cells[i];
    return Box{cell.x + layout.frame, cell.y + layout.frame, cell.width - 2 * layout.frame,
               cell.height - 2 * layout.frame};
  };
  FilmScenes scenes(SizeOf(picture(0)));
  for (const FilmedEpisode& episode : episodes) FindCamera(scenes.Of(episode)->model(), options.camera);
  Frame frame(options.size);
  FilmPanels panels(&frame, layout.scale);
  panels.Page();
  Shots shots;
  VideoWriter video(file, options.size, kFilmRate);
  const size_t longest = LongestOf(episodes);
  const size_t shown = std::min(episodes.size(), layout.cells.size());
  size_t succeeded = 0, failed = 0;
  for (size_t n = 0; n <= longest; ++n) {
    CheckStop();
    for (size_t i = 0; i < shown; ++i) {
      const FilmedEpisode& episode = episodes[i];
      // Once more when it is over; then it stays.
      if (n > episode.states.size()) continue;
      const bool is_over = n == episode.states.size();
      const size_t state = std::min(n, episode.states.size() - 1);
      Renderer* const renderer = scenes.Of(episode);
      const int camera = FindCamera(renderer->model(), options.camera);
      renderer->SetState(episode.states[state]);
      const Box box = picture(i);
      shots.Draw(renderer, camera, box, &frame);
      std::vector<FilmPanels::Place> places = PlacesOf(episode, state, *renderer, camera, box);
      std::erase_if(places, [](const auto& place) { return place.kind == FilmMark::Kind::kGrasp; });
      panels.Places(box, places, false);
      panels.Cell(layout.cells[i], layout.frame, episode.name, episode.facts, is_over);
      if (is_over) {
        succeeded += EndOf(episode.facts) == FilmEnd::kSuccess;
        failed += EndOf(episode.facts) == FilmEnd::kFailure;
      }
    }
    double time = TimeOf(n);
    if (n == longest) {
      time = 0;
      for (const FilmedEpisode& episode : episodes) time = std::max(time, episode.facts.duration_s);
    }
    panels.Blank(layout.header);
    panels.Header(layout.header, options.title, options.subtitle,
                  fmt::format("{} succeeded, {} failed    {}", succeeded, failed, ClockText(time)));
    for (int i = 0; i < (n < longest ? 1 : kPanelHold); ++i) video.Write(frame);
    if (options.progress) options.progress(static_cast<double>(n + 1) / static_cast<double>(longest + 1));
  }
  video.Close();
}

}  // namespace evalbus::viz
