#include "viz/images/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include "base/errors.h"
#include "lcmtypes/clock.h"
#include "viz/images/log_episodes.h"
#include "viz/images/panel_video.h"
#include "viz/images/parallel_frame_renderer.h"
#include "viz/images/trail.h"
#include "viz/images/video_writer.h"

namespace evalbus::viz {
namespace {

// Content of one frame.
struct Shown {
  const state_t* state;
  OverlayText text;
};

// Returns one entry per frame. If the video shows the end of the episode, the last entry is repeated
// kVideoHold times.
std::vector<Shown> WhatIsShown(const EpisodeMessages& episode, const VideoOptions& options) {
  OverlayText text;
  text.title = episode.model->task + "/" + episode.model->variation;
  text.subtitle = EpisodeSubtitle(episode.number());
  text.maker = MakerText(options.policy, episode.model->robot);
  std::vector<int64_t> sim_time_us;
  for (const state_t& state : episode.states) sim_time_us.push_back(state.header.sim_time_us);
  std::vector<Shown> shown;
  size_t num_scored = 0;
  const auto show = [&](size_t state, const std::string& clock) {
    while (num_scored < episode.partials.size() &&
           episode.partials[num_scored].header.tick <= episode.states[state].header.tick) {
      ++num_scored;
    }
    if (num_scored > 0) AddScores(episode.partials[num_scored - 1].metrics, &text);
    text.clock = clock;
    shown.push_back({&episode.states[state], text});
  };
  const std::vector<FrameTime> times = TimesOf(episode, options.timing);
  const std::vector<size_t> schedule = VideoSchedule(sim_time_us, times);
  for (size_t n = 0; n < schedule.size(); ++n) show(schedule[n], ClockText(times[n]));
  if (ShowsEnd(episode, options.timing)) {
    text.end_reason = episode.outcome();
    show(episode.states.size() - 1, ClockText({Seconds(sim_time_us.back()), 1}));
  }
  return shown;
}

// Writes one file per camera. progress: receives the progress of this episode.
void MakePlainVideo(const EpisodeMessages& episode, const VideoOptions& options,
                    const std::filesystem::path& log, const std::vector<std::string>& cameras,
                    ParallelFrameRenderer* frame_renderer, const std::vector<std::filesystem::path>& files,
                    const VideoProgress& progress) {
  const FrameSize size = frame_renderer->largest();
  std::vector<std::unique_ptr<VideoWriter>> videos;
  for (const std::filesystem::path& file : files) {
    videos.push_back(std::make_unique<VideoWriter>(file, size, kVideoRate));
  }
  const std::vector<Shown> shown = WhatIsShown(episode, options);
  const Overlay overlay(size, options.overlay);
  const auto begin = [&](VideoScenes* scenes) {
    Renderer* const renderer =
        scenes->Of(*episode.model, log, episode.begin ? std::optional(episode.begin->seed) : std::nullopt);
    std::vector<int> ids;
    for (const std::string& camera : cameras) ids.push_back(FindCamera(renderer->model(), camera));
    return [&, renderer, ids, frames = std::vector<Frame>(cameras.size(), Frame(size))](size_t n) mutable {
      renderer->SetState(*shown[n].state);
      for (size_t i = 0; i < ids.size(); ++i) {
        renderer->Render(ids[i], &frames[i]);
        if (options.trail_s > 0) {
          const std::span states(episode.states.data(), shown[n].state + 1);
          DrawTrails(states, options.trail_s, renderer->PoseOf(ids[i]), &frames[i]);
        }
        overlay.Draw(shown[n].text, &frames[i]);
      }
      return frames;
    };
  };
  frame_renderer->Render(shown.size(), begin, [&](size_t n, const std::vector<Frame>& frames) {
    const bool is_end = ShowsEnd(episode, options.timing) && n + 1 == shown.size();
    for (size_t i = 0; i < videos.size(); ++i) {
      for (int times = 0; times < (is_end ? kVideoHold : 1); ++times) videos[i]->Write(frames[i]);
    }
    progress(static_cast<double>(n + 1) / static_cast<double>(shown.size()));
  });
  for (const auto& video : videos) video->Close();
}

}  // namespace

VideoLayout ParseVideoLayout(const std::string& name) {
  if (name == "plain") return VideoLayout::kPlain;
  if (name == kFullLayout) return VideoLayout::kFull;
  throw InputError("--layout " + name + ": expected plain or full");
}

std::string VideoName(std::string camera, const std::string& ending) {
  std::replace(camera.begin(), camera.end(), '/', '_');
  return camera + ending;
}

void CheckCameras(const mjModel& model, const std::vector<std::string>& cameras) {
  std::set<std::string> videos;
  for (const std::string& camera : cameras) {
    FindCamera(model, camera);
    if (!videos.insert(VideoName(camera)).second) {
      throw InputError("camera '" + camera + "' is given twice, or another camera has the same file name " +
                       VideoName(camera));
    }
  }
}

std::vector<std::filesystem::path> MakeLogVideos(const std::filesystem::path& log,
                                                 const std::vector<std::string>& cameras,
                                                 ParallelFrameRenderer* frame_renderer,
                                                 const std::filesystem::path& folder,
                                                 const VideoOptions& options) {
  const std::vector<int> numbers = EpisodesOf(log);
  const auto is_wanted = [&](int number) {
    return options.episodes.empty() || std::ranges::find(options.episodes, number) != options.episodes.end();
  };
  CheckEpisodes(log, numbers, options.episodes);
  if (!options.file.empty()) {
    const auto videos = std::ranges::count_if(numbers, is_wanted) *
                        (options.layout == VideoLayout::kFull ? 1 : static_cast<ptrdiff_t>(cameras.size()));
    if (videos != 1) {
      throw InputError(
          fmt::format("{} videos cannot be written to one file: {}", videos, options.file.string()));
    }
  }
  const auto wanted = static_cast<double>(std::ranges::count_if(numbers, is_wanted));
  std::vector<std::filesystem::path> files;
  std::map<int, int> times;
  double done = 0;
  EpisodeReader reader(log, kVideoChannels);
  ModelPtr model;
  std::string model_sha256;
  for (EpisodeMessages episode; reader.Next(&episode, is_wanted);) {
    if (episode.states.empty()) continue;
    const int number = episode.number();
    if (!episode.model) throw InputError(log.string() + ": no complete MODEL message before the first STATE");
    if (!model || episode.model->visual_sha256 != model_sha256) {
      model = VisualModel(*episode.model, log);
      model_sha256 = episode.model->visual_sha256;
      CheckCameras(*model, cameras);
    }
    std::string before;
    if (numbers.size() > 1) {
      before = fmt::format("episode_{:04}_", number);
      if (const int n = ++times[number]; n > 1) before += fmt::format("{}_", n);
    }
    const auto progress = [&](double share) {
      if (options.progress) options.progress((done + share) / wanted);
    };
    const auto file = [&](const std::string& what) {
      return options.file.empty()
                 ? folder / (before + VideoName(what, NameSuffix(options.timing) + options.ending))
                 : options.file;
    };
    if (options.layout == VideoLayout::kFull) {
      files.push_back(file(kFullLayout));
      MakeFullVideo(ToVideoEpisode(episode, options.policy, log, options.timing),
                    cameras.empty() ? FullCameras(*model) : cameras, frame_renderer, files.back(), progress);
    } else {
      std::vector<std::filesystem::path> videos;
      for (const std::string& camera : cameras) videos.push_back(file(camera));
      MakePlainVideo(episode, options, log, cameras, frame_renderer, videos, progress);
      files.insert(files.end(), videos.begin(), videos.end());
    }
    ++done;
  }
  return files;
}

}  // namespace evalbus::viz
