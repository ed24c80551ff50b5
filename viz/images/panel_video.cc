#include "viz/images/panel_video.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/text.h"
#include "viz/images/log_episodes.h"
#include "viz/images/overlay.h"
#include "viz/images/video.h"
#include "viz/images/video_panels.h"
#include "viz/images/video_writer.h"

namespace evalbus::viz {
namespace {

// Returns a readable name, such as "left wrist" for the camera "left/hand/wrist".
std::string CameraWords(const std::string& camera) {
  const size_t first = camera.find('/'), last = camera.rfind('/');
  if (first == std::string::npos) return Printable(camera);
  return Printable(camera.substr(0, first) + " " + camera.substr(last + 1));
}

FrameSize SizeOf(const Box& box) { return {static_cast<int>(box.width), static_cast<int>(box.height)}; }

// Draws camera images into boxes of a frame.
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

std::vector<VideoPanels::Place> PlacesOf(const VideoEpisode& episode, size_t frame, const Renderer& renderer,
                                         int camera, const Box& box) {
  std::vector<VideoPanels::Place> places;
  const CameraPose pose = renderer.PoseOf(camera);
  for (const PlaceMark& mark : episode.facts.places[frame]) {
    if (const auto point = Project(pose, SizeOf(box), mark.position_m)) places.push_back({mark.kind, *point});
  }
  return places;
}

Renderer* RendererOf(const VideoEpisode& episode, VideoScenes* scenes) {
  return scenes->Of(episode.model, episode.log, episode.seed);
}

// A frame and the objects that draw into it.
struct Sheet {
  Sheet(FrameSize size, double scale) : frame(size), panels(&frame, scale) {}
  Frame frame;
  VideoPanels panels;
  Shots shots;
};

// Returns the duration of the longest episode.
double LongestOf(const std::vector<VideoEpisode>& episodes) {
  double longest_s = 0;
  for (const VideoEpisode& episode : episodes) longest_s = std::max(longest_s, episode.facts.duration_s);
  return longest_s;
}

// Returns the frame times of a video of several episodes: the frame times of the longest episode, then end_s
// (or, if the video does not show the end, its last time again).
std::vector<FrameTime> JointTimes(const std::vector<VideoEpisode>& episodes, double end_s) {
  const auto longest = std::ranges::max_element(
      episodes, {}, [](const VideoEpisode& episode) { return episode.states.size(); });
  std::vector<FrameTime> times = longest->times;
  times.push_back(longest->shows_end ? FrameTime{end_s, 1} : times.back());
  return times;
}

// Returns whether an episode has ended before this frame.
bool IsOver(const VideoEpisode& episode, size_t frame) {
  return episode.shows_end && frame >= episode.states.size();
}

// Writes the frames. Frames with numbers of at least `end` show the end of the episode and are each repeated
// kPanelHold times.
void WriteFrames(size_t num_frames, size_t end, FrameSize size, const VideoProgress& progress,
                 const std::filesystem::path& file, ParallelFrameRenderer* frame_renderer,
                 const ParallelFrameRenderer::Begin& begin) {
  VideoWriter video(file, size, kVideoRate);
  frame_renderer->Render(num_frames, begin, [&](size_t n, const std::vector<Frame>& frames) {
    for (int times = 0; times < (n < end ? 1 : kPanelHold); ++times) video.Write(frames[0]);
    if (progress) progress(static_cast<double>(n + 1) / static_cast<double>(num_frames));
  });
  video.Close();
}

}  // namespace

VideoEpisode ToVideoEpisode(const EpisodeMessages& episode, const std::string& policy,
                            const std::filesystem::path& log, const VideoTiming& timing) {
  std::vector<int64_t> sim_time_us;
  for (const state_t& state : episode.states) sim_time_us.push_back(state.header.sim_time_us);
  VideoEpisode video_episode;
  video_episode.times = TimesOf(episode, timing);
  video_episode.shows_end = ShowsEnd(episode, timing);
  const std::vector<size_t> schedule = VideoSchedule(sim_time_us, video_episode.times);
  video_episode.log = log;
  video_episode.model = *episode.model;
  if (episode.begin) video_episode.seed = episode.begin->seed;
  video_episode.facts = FactsOf(episode, schedule, policy);
  for (const size_t shown : schedule) video_episode.states.push_back(episode.states[shown]);
  return video_episode;
}

std::vector<VideoEpisode> ReadVideoEpisodes(const std::filesystem::path& log,
                                            const std::vector<int>& episodes, const std::string& policy,
                                            const VideoTiming& timing) {
  const std::vector<int> numbers = EpisodesOf(log);
  CheckEpisodes(log, numbers, episodes);
  const auto is_wanted = [&](int number) {
    return episodes.empty() || std::ranges::find(episodes, number) != episodes.end();
  };
  std::vector<VideoEpisode> video_episodes;
  EpisodeReader reader(log, kVideoChannels);
  for (EpisodeMessages episode; reader.Next(&episode, is_wanted);) {
    if (episode.states.empty()) continue;
    if (!episode.model) throw InputError(log.string() + ": no complete MODEL message before the first STATE");
    video_episodes.push_back(ToVideoEpisode(episode, policy, log, timing));
  }
  return video_episodes;
}

double ReadDecisiveMoment(const std::filesystem::path& log, int number) {
  EpisodeReader reader(log, {});
  EpisodeMessages episode;
  if (!reader.Next(&episode, [number](int other) { return other == number; })) {
    throw InputError(fmt::format("{} has no episode {}", log.string(), number));
  }
  return DecisiveMoment(episode);
}

std::vector<std::string> FullCameras(const mjModel& model) {
  std::vector<std::string> cameras = {kDefaultCamera};
  const auto add = [&](const std::function<bool(const std::string&)>& is_wanted) {
    for (int i = 0; i < model.ncam; ++i) {
      const char* name = mj_id2name(&model, mjOBJ_CAMERA, i);
      if (name && is_wanted(name) && cameras.size() <= kMaxInsets) cameras.push_back(name);
    }
  };
  add([](const std::string& name) { return name == "head"; });
  add([](const std::string& name) { return name.ends_with("/wrist"); });
  return cameras;
}

void MakeFullVideo(const VideoEpisode& episode, const std::vector<std::string>& cameras,
                   ParallelFrameRenderer* frame_renderer, const std::filesystem::path& file,
                   const VideoProgress& progress) {
  const FrameSize size = frame_renderer->largest();
  CheckPanelSize(size);
  if (cameras.size() > kMaxInsets + 1) {
    throw InputError(fmt::format("the full layout shows at most {} cameras, the first one large; got {}",
                                 kMaxInsets + 1, cameras.size()));
  }
  const VideoFacts& facts = episode.facts;
  const FullLayout layout =
      LayOutFull(size, static_cast<int>(cameras.size()) - 1, static_cast<int>(facts.curves.size()));
  const std::string subtitle = facts.maker + ", " + EpisodeSubtitle(facts.episode);
  const size_t num_states = episode.states.size();
  const bool has_end = episode.shows_end && EndOf(facts) != VideoEnd::kNone;
  const size_t num_frames = num_states + (has_end ? 1 : 0);
  const auto begin = [&](VideoScenes* scenes) {
    Renderer* const renderer = RendererOf(episode, scenes);
    std::vector<int> ids;
    for (const std::string& camera : cameras) ids.push_back(FindCamera(renderer->model(), camera));
    const auto sheet = std::make_shared<Sheet>(size, layout.scale);
    return [&, renderer, ids, sheet](size_t n) {
      VideoPanels& panels = sheet->panels;
      const bool is_end = n == num_states;
      const size_t shown = is_end ? n - 1 : n;
      const FrameTime frame_time = is_end ? FrameTime{facts.duration_s, 1} : episode.times[n];
      const double time = frame_time.time_s;
      panels.Page();
      panels.Header(layout.header, facts.task, subtitle, ClockText(frame_time));
      renderer->SetState(episode.states[shown]);
      for (size_t i = 0; i < ids.size(); ++i) {
        const Box& box = i == 0 ? layout.main : layout.insets[i - 1];
        sheet->shots.Draw(renderer, ids[i], box, &sheet->frame);
        panels.Places(box, PlacesOf(episode, shown, *renderer, ids[i], box), i == 0);
        if (i > 0) panels.Caption(box, CameraWords(cameras[i]));
      }
      panels.Stages(layout.stages, facts, time);
      for (size_t i = 0; i < layout.curves.size(); ++i) {
        panels.Curve(layout.curves[i], facts, facts.curves[i], time, facts.duration_s,
                     facts.curves[i].highest);
      }
      panels.TimeLine(layout.time_line, facts, time, facts.duration_s);
      if (is_end) panels.EndCard(layout.main, facts);
      return std::vector{sheet->frame};
    };
  };
  WriteFrames(num_frames, num_states, size, progress, file, frame_renderer, begin);
}

void MakePairVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file) {
  CheckPanelSize(options.size);
  const PairLayout layout = LayOutPair(options.size);
  // Both sides use the same axis ranges.
  const double to_s = LongestOf(episodes);
  const auto highest = [&](const std::string& label) {
    double most = 0;
    for (const VideoEpisode& episode : episodes) {
      for (const VideoCurve& curve : episode.facts.curves) {
        if (curve.label == label) most = std::max(most, curve.highest);
      }
    }
    return most;
  };
  const std::vector<FrameTime> times = JointTimes(episodes, to_s);
  const auto begin = [&](VideoScenes* scenes) {
    const auto sheet = std::make_shared<Sheet>(options.size, layout.scale);
    return [&, scenes, sheet](size_t n) {
      VideoPanels& panels = sheet->panels;
      panels.Page();
      panels.Header(layout.header, options.title, options.subtitle, ClockText(times[n]));
      for (size_t i = 0; i < episodes.size(); ++i) {
        const VideoEpisode& episode = episodes[i];
        const PairLayout::Side& side = layout.side[i];
        const VideoFacts& facts = episode.facts;
        const bool is_over = IsOver(episode, n);
        const size_t shown = std::min(n, episode.states.size() - 1);
        const double own_time = is_over ? facts.duration_s : times[n].time_s;
        Renderer* const renderer = RendererOf(episode, scenes);
        const int camera = FindCamera(renderer->model(), options.camera);
        panels.Title(side.title, facts, episode.name, is_over);
        renderer->SetState(episode.states[shown]);
        sheet->shots.Draw(renderer, camera, side.image, &sheet->frame);
        panels.Places(side.image, PlacesOf(episode, shown, *renderer, camera, side.image), true);
        panels.Stages(side.stages, facts, own_time);
        if (!facts.curves.empty()) {
          const VideoCurve& curve = facts.curves[0];
          panels.Curve(side.curve, facts, curve, own_time, to_s, highest(curve.label));
        }
        panels.TimeLine(side.time_line, facts, own_time, to_s);
        if (is_over) panels.Ending(side.image, facts);
      }
      return std::vector{sheet->frame};
    };
  };
  ParallelFrameRenderer frame_renderer(options.size);
  WriteFrames(times.size(), times.size() - 1, options.size, options.progress, file, &frame_renderer, begin);
}

void MakeGridVideo(const std::vector<VideoEpisode>& episodes, const JointVideoOptions& options,
                   const std::filesystem::path& file) {
  CheckPanelSize(options.size);
  const GridLayout layout = LayOutGrid(options.size, options.shape.columns, options.shape.rows);
  const auto image = [&](size_t i) {
    const Box& cell = layout.cells[i];
    return Box{cell.x + layout.frame, cell.y + layout.frame, cell.width - 2 * layout.frame,
               cell.height - 2 * layout.frame};
  };
  const size_t cells = std::min(episodes.size(), layout.cells.size());
  const std::vector<FrameTime> times = JointTimes(episodes, LongestOf(episodes));
  const auto begin = [&](VideoScenes* scenes) {
    const auto sheet = std::make_shared<Sheet>(options.size, layout.scale);
    sheet->panels.Page();
    return [&, scenes, sheet, is_done = std::vector<bool>(cells)](size_t n) mutable {
      VideoPanels& panels = sheet->panels;
      size_t succeeded = 0, failed = 0;
      for (size_t i = 0; i < cells; ++i) {
        const VideoEpisode& episode = episodes[i];
        const bool is_over = IsOver(episode, n);
        if (is_over) {
          succeeded += EndOf(episode.facts) == VideoEnd::kSuccess;
          failed += EndOf(episode.facts) == VideoEnd::kFailure;
        }
        // A finished episode is drawn once more, with its outcome. After that, its cell does not change.
        if (is_done[i]) continue;
        is_done[i] = is_over;
        const size_t state = std::min(n, episode.states.size() - 1);
        Renderer* const renderer = RendererOf(episode, scenes);
        const int camera = FindCamera(renderer->model(), options.camera);
        renderer->SetState(episode.states[state]);
        const Box box = image(i);
        sheet->shots.Draw(renderer, camera, box, &sheet->frame);
        std::vector<VideoPanels::Place> places = PlacesOf(episode, state, *renderer, camera, box);
        std::erase_if(places, [](const auto& place) { return place.kind == VideoMark::Kind::kGrasp; });
        panels.Places(box, places, false);
        panels.Cell(layout.cells[i], layout.frame, episode.name, episode.facts, is_over);
      }
      panels.Blank(layout.header);
      panels.Header(layout.header, options.title, options.subtitle,
                    fmt::format("{} succeeded, {} failed    {}", succeeded, failed, ClockText(times[n])));
      return std::vector{sheet->frame};
    };
  };
  ParallelFrameRenderer frame_renderer(SizeOf(image(0)));
  WriteFrames(times.size(), times.size() - 1, options.size, options.progress, file, &frame_renderer, begin);
}

}  // namespace evalbus::viz
