// Several processes render the frames of a video. The frames are in order and identical for any number of
// processes. All processes end when one of them fails.
#include "viz/images/parallel_frame_renderer.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstring>
#include <functional>
#include <set>
#include <stdexcept>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"

namespace evalbus::viz::parallel_frame_renderer_test {

constexpr FrameSize kRendererSize{64, 48};

TEST(ParallelFrameRendererTest, AnyNumberOfProcessesDrawsEqualFrames) {
  const Scene scene = LiftPotScene();
  TemporaryFolder folder;
  const std::filesystem::path log =
      WriteRun(folder.path(), *scene.visual, 20000, std::vector(7, HomeQpos(*scene.visual)));
  const model_info_t info = VisualInfo(folder.path(), *scene.visual);
  // The pot moves down from frame to frame.
  const auto video = [&](size_t processes) {
    std::vector<Frame> drawn;
    ParallelFrameRenderer frame_renderer(kRendererSize, processes);
    const auto begin = [&](VideoScenes* scenes) {
      Renderer* const renderer = scenes->Of(info, log, std::nullopt);
      return [&, renderer](size_t n) {
        std::vector<double> qpos = HomeQpos(*scene.visual);
        qpos[static_cast<size_t>(QposIndex(*scene.visual, "pot")) + 2] -= 0.1 * static_cast<double>(n);
        renderer->SetState(StateOf(qpos));
        Frame frame(kRendererSize);
        renderer->Render(FindCamera(renderer->model(), "front"), &frame);
        return std::vector{frame};
      };
    };
    frame_renderer.Render(7, begin, [&](size_t n, const std::vector<Frame>& frames) {
      EXPECT_EQ(n, drawn.size());
      drawn.push_back(frames[0]);
    });
    return drawn;
  };
  const std::vector<Frame> alone = video(1), three = video(3);
  ASSERT_EQ(alone.size(), 7u);
  ASSERT_EQ(three.size(), 7u);
  for (size_t n = 0; n < 7; ++n) EXPECT_EQ(alone[n].bgrx, three[n].bgrx) << n;
  EXPECT_NE(alone[0].bgrx, alone[6].bgrx);
}

// A rendering that only counts its frames.
struct Count {
  pid_t process;
  size_t n;
};

Frame Drawn(size_t n) {
  Frame frame({2, 2});
  const Count count{getpid(), n};
  static_assert(sizeof count == 16);
  std::memcpy(frame.bgrx.data(), &count, sizeof count);
  return frame;
}

Count CountOf(const Frame& frame) {
  Count count;
  std::memcpy(&count, frame.bgrx.data(), sizeof count);
  return count;
}

TEST(ParallelFrameRendererTest, FirstFrameIsDrawnHereAndTheOthersInTurns) {
  ParallelFrameRenderer frame_renderer(kRendererSize, 3);
  for (int i = 0; i < 2; ++i) {
    int begun = 0;
    std::vector<pid_t> processes;
    frame_renderer.Render(
        40,
        [&](VideoScenes*) {
          ++begun;
          return [](size_t n) { return std::vector{Drawn(n), Drawn(n + 100)}; };
        },
        [&](size_t n, const std::vector<Frame>& frames) {
          ASSERT_EQ(frames.size(), 2u);
          EXPECT_EQ(n, processes.size());
          EXPECT_EQ(CountOf(frames[0]).n, n);
          EXPECT_EQ(CountOf(frames[1]).n, n + 100);
          processes.push_back(CountOf(frames[0]).process);
        });
    EXPECT_EQ(begun, 1);
    ASSERT_EQ(processes.size(), 40u);
    EXPECT_EQ(processes[0], getpid());
    EXPECT_EQ(std::set(processes.begin(), processes.end()).size(), 4u);
    for (size_t n = 1; n + 3 < 40; ++n) EXPECT_EQ(processes[n], processes[n + 3]) << n;
    // The processes have ended, and the parent has waited for them.
    for (size_t n = 1; n < 4; ++n) EXPECT_EQ(kill(processes[n], 0), -1);
  }
}

// Returns the error of a video of 9 frames. draw(n) is called just before frame n is drawn.
template <class Error>
std::string EndOf(ParallelFrameRenderer* frame_renderer, const std::function<void(size_t n)>& draw,
                  size_t* taken) {
  *taken = 0;
  const auto begin = [&](VideoScenes*) {
    return [&](size_t n) {
      draw(n);
      return std::vector{Drawn(n)};
    };
  };
  try {
    frame_renderer->Render(9, begin, [&](size_t, const std::vector<Frame>&) { ++*taken; });
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ParallelFrameRendererTest, WhatDrawingThrowsEndsTheVideoAndTheNextOneIsWhole) {
  ParallelFrameRenderer frame_renderer(kRendererSize, 2);
  size_t taken = 0;
  for (const size_t at : {5u, 0u}) {
    const auto fail = [&]<class Error>(Error error) {
      return EndOf<Error>(
          &frame_renderer, [&](size_t n) { n == at ? throw error : void(); }, &taken);
    };
    EXPECT_EQ(fail(InputError("no such file")), "no such file");
    EXPECT_EQ(taken, at);
    EXPECT_EQ(fail(EnvironmentError("no OpenGL")), "no OpenGL");
    EXPECT_EQ(fail(std::runtime_error("frame")), "frame");
  }
  EXPECT_EQ(EndOf<std::exception>(
                &frame_renderer, [](size_t) {}, &taken),
            "");
  EXPECT_EQ(taken, 9u);
}

TEST(ParallelFrameRendererTest, ProcessThatDiesEndsTheVideo) {
  ParallelFrameRenderer frame_renderer(kRendererSize, 2);
  const pid_t here = getpid();
  const auto die = [&](size_t n) {
    if (n == 6 && getpid() != here) raise(SIGKILL);
  };
  size_t taken = 0;
  EXPECT_EQ(EndOf<EnvironmentError>(&frame_renderer, die, &taken),
            "a rendering process was ended by a signal: Killed");
  EXPECT_EQ(taken, 6u);
}

TEST(ParallelFrameRendererTest, FramesOfAnotherSizeAreRefused) {
  ParallelFrameRenderer frame_renderer(kRendererSize, 2);
  for (const size_t frames : {1u, 3u}) {
    const auto begin = [&](VideoScenes*) {
      return [&](size_t n) { return std::vector(n == 4 ? frames : 2, Drawn(n)); };
    };
    EXPECT_THROW(frame_renderer.Render(9, begin, [](size_t, const std::vector<Frame>&) {}),
                 std::runtime_error);
  }
}

TEST(ParallelFrameRendererTest, OutlinesAreThoseOfTheTasksObjects) {
  const Scene scene = LiftPotScene();
  TemporaryFolder folder;
  const std::filesystem::path log =
      WriteRun(folder.path(), *scene.visual, 20000, std::vector(1, HomeQpos(*scene.visual)));
  model_info_t info = VisualInfo(folder.path(), *scene.visual);
  const int pot = mj_name2id(scene.visual.get(), mjOBJ_BODY, "pot");
  info.num_entities = 3;
  info.entity_name = {"world", "pot", "lid"};
  info.entity_kind = {model_info_t::WORLD, model_info_t::OBJECT, model_info_t::OBJECT};
  info.num_bodies = static_cast<int32_t>(scene.visual->nbody);
  info.body_name.resize(static_cast<size_t>(scene.visual->nbody));
  for (int body = 0; body < scene.visual->nbody; ++body) {
    info.body_entity.push_back(scene.visual->body_rootid[body] == pot ? 1 : 0);
  }
  const auto draw = [&](bool are_outlined, int32_t object) {
    info.num_objects = 1;
    info.object_name = {"object"};
    info.object_is_tracked = {1};
    info.object_entity = {object};
    VideoScenes scenes(kRendererSize, are_outlined);
    Renderer* const renderer = scenes.Of(info, log, std::nullopt);
    renderer->SetState(StateOf(HomeQpos(*scene.visual)));
    Frame frame(kRendererSize);
    renderer->Render(FindCamera(renderer->model(), "front"), &frame);
    return frame.bgrx;
  };
  EXPECT_NE(draw(true, 1), draw(false, 1));
  EXPECT_EQ(draw(true, 2), draw(false, 1));
}

TEST(ParallelFrameRendererTest, ScenesStayWhileTheyAreUsed) {
  const Scene scene = LiftPotScene();
  TemporaryFolder folder;
  const std::filesystem::path log =
      WriteRun(folder.path(), *scene.visual, 20000, std::vector(1, HomeQpos(*scene.visual)));
  const model_info_t info = VisualInfo(folder.path(), *scene.visual);
  VideoScenes scenes(kRendererSize);
  Renderer* const first = scenes.Of(info, log, std::nullopt);
  scenes.FreeUnused();
  EXPECT_EQ(scenes.Of(info, log, std::nullopt), first);
  scenes.FreeUnused();
  scenes.FreeUnused();
  // The log is read again and names a model file that no longer exists.
  std::filesystem::remove_all(folder.path() / "model");
  EXPECT_THROW(scenes.Of(info, log, std::nullopt), InputError);
}

}  // namespace evalbus::viz::parallel_frame_renderer_test
