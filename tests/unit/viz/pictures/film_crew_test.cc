// Frames of films, drawn by several threads: the same whatever their number, in order, and an end to all when
// one of them fails.
#include "viz/pictures/film_crew.h"

#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <stdexcept>
#include <thread>

#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"

namespace evalbus::viz::film_crew_test {

constexpr FrameSize kCrewSize{64, 48};

TEST(FilmCrewTest, AnyNumberOfThreadsDrawsEqualFrames) {
  const Scene scene = LiftPotScene();
  TemporaryFolder folder;
  const std::filesystem::path log =
      WriteRun(folder.path(), *scene.visual, 20000, std::vector(7, HomeQpos(*scene.visual)));
  const model_info_t info = VisualInfo(folder.path(), *scene.visual);
  // The pot sinks from frame to frame.
  const auto film = [&](size_t threads) {
    std::vector<Frame> drawn;
    FilmCrew crew(kCrewSize, threads);
    const auto begin = [&](FilmScenes* scenes) {
      Renderer* const renderer = scenes->Of(info, log, std::nullopt);
      return [&, renderer](size_t n) {
        std::vector<double> qpos = HomeQpos(*scene.visual);
        qpos[static_cast<size_t>(QposIndex(*scene.visual, "pot")) + 2] -= 0.1 * static_cast<double>(n);
        renderer->SetState(StateOf(qpos));
        Frame frame(kCrewSize);
        renderer->Render(FindCamera(renderer->model(), "front"), &frame);
        return std::vector{frame};
      };
    };
    crew.Film(7, begin, [&](size_t n, const std::vector<Frame>& frames) {
      EXPECT_EQ(n, drawn.size());
      drawn.push_back(frames[0]);
    });
    return drawn;
  };
  const std::vector<Frame> alone = film(1), three = film(3);
  ASSERT_EQ(alone.size(), 7u);
  ASSERT_EQ(three.size(), 7u);
  for (size_t n = 0; n < 7; ++n) EXPECT_EQ(alone[n].bgrx, three[n].bgrx) << n;
  EXPECT_NE(alone[0].bgrx, alone[6].bgrx);
}

TEST(FilmCrewTest, EachThreadBeginsOnceInEachFilm) {
  FilmCrew crew(kCrewSize, 3);
  for (int i = 0; i < 2; ++i) {
    std::atomic<int> begun = 0;
    std::set<std::thread::id> threads;
    size_t taken = 0;
    crew.Film(
        20,
        [&](FilmScenes*) {
          ++begun;
          return [](size_t) { return std::vector<Frame>(); };
        },
        [&](size_t n, const std::vector<Frame>&) {
          threads.insert(std::this_thread::get_id());
          EXPECT_EQ(n, taken++);
        });
    EXPECT_EQ(begun, 3);
    EXPECT_EQ(taken, 20u);
    EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
  }
}

TEST(FilmCrewTest, WhatDrawingThrowsEndsTheFilmAndTheNextOneIsWhole) {
  FilmCrew crew(kCrewSize, 2);
  const auto draw = [&](size_t fails_at) {
    size_t taken = 0;
    try {
      crew.Film(
          9,
          [&](FilmScenes*) {
            return [&](size_t n) -> std::vector<Frame> {
              if (n == fails_at) throw std::runtime_error("frame");
              return {};
            };
          },
          [&](size_t, const std::vector<Frame>&) { ++taken; });
    } catch (const std::runtime_error&) {
      EXPECT_EQ(taken, fails_at);
    }
    return taken;
  };
  EXPECT_EQ(draw(5), 5u);
  EXPECT_EQ(draw(0), 0u);
  EXPECT_EQ(draw(99), 9u);
}

}  // namespace evalbus::viz::film_crew_test
