// Films beside a run, and from its logs afterwards.
#include <algorithm>

#include "tests/integration/harness.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

TEST(Filming, RunEndsWithTheFilmsOfItsEpisodes) {
  const TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.2);
  const fs::path run = folder.path() / "run";
  const Result result = RunProgram({"evalbus", "run", task, "--policy", "hold", "--episodes", "2",
                                    "--in-process", "--video", "front,left/hand/wrist", "--out", run});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("run/episodes/*/front.mp4  (done after "), std::string::npos) << result.out;
  for (const char* film : {"0000/front.mp4", "0000/left_hand_wrist.mp4", "0001/front.mp4"}) {
    EXPECT_GT(fs::file_size(run / "episodes" / film), 1000u) << film;
  }

  // Later, from the log, it is the same film.
  const std::string film = ReadText(run / "episodes/0001/front.mp4");
  const Result again = RunProgram({"evalbus", "render", run, "--episode", "1", "--camera", "front"});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_TRUE(ReadText(run / "episodes/0001/front.mp4") == film);
  EXPECT_TRUE(again.out.ends_with("run/episodes/0001/front.mp4\n")) << again.out;
}

// What `./run` adds cameras to unless it is told not to.
TEST(Filming, NoneIsNoCamera) {
  const TemporaryFolder folder;
  const Result result =
      RunProgram({"evalbus", "run", ShortTask(folder.path(), 0.2), "--policy", "hold", "--episodes", "1",
                  "--in-process", "--video", "none", "--out", folder.path() / "run"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("films"), std::string::npos) << result.out;
}

TEST(Filming, MissingFfmpegCostsTheFilmAndNotTheResults) {
  const TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.2);
  const fs::path run = folder.path() / "run";
  const Result result = RunProgram({"evalbus", "run", task, "--policy", "hold", "--episodes", "1",
                                    "--in-process", "--video", "front", "--out", run},
                                   {{}, [] { setenv("PATH", "/nonexistent", 1); }});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.err,
            "error: no film: films need the ffmpeg program: install it with 'apt-get install ffmpeg'\n");
  EXPECT_TRUE(fs::exists(run / "episodes.jsonl"));
}

TEST(Filming, UnknownCameraIsRefusedBeforeTheRun) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const Result result =
      RunProgram({"evalbus", "run", "lift_pot", "--in-process", "--video", "nowhere", "--out", run});
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.err,
            "error: no camera 'nowhere'; this scene has head, front, overview, left/hand/wrist, "
            "right/hand/wrist\n");
  EXPECT_FALSE(fs::exists(run));
}

}  // namespace
}  // namespace evalbus
