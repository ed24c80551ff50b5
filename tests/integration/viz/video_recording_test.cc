// Tests videos that are recorded during a run, or rendered from its logs afterwards.
#include <signal.h>

#include <algorithm>

#include "tests/integration/harness.h"

namespace evalbus::video_recording_test {

namespace fs = std::filesystem;

TEST(VideoRecording, RunEndsWithTheVideosOfItsEpisodes) {
  const TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.2);
  const fs::path run = folder.path() / "run";
  const Result result = RunProgram({"evalbus", "run", task, "--policy", "hold", "--episodes", "2",
                                    "--in-process", "--video", "front,left/hand/wrist", "--out", run});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("run/episodes/*/front.mp4  (complete after "), std::string::npos) << result.out;
  for (const char* video : {"0000/front.mp4", "0000/left_hand_wrist.mp4", "0001/front.mp4"}) {
    EXPECT_GT(fs::file_size(run / "episodes" / video), 1000u) << video;
  }

  const nlohmann::json json = nlohmann::json::parse(ReadText(run / "run.json"));
  EXPECT_EQ(json["gl"], "osmesa");
  EXPECT_TRUE(json["renderer"].get<std::string>().starts_with("osmesa (llvmpipe")) << json["renderer"];

  // A video rendered later from the log is identical.
  const std::string video = ReadText(run / "episodes/0001/front.mp4");
  const Result again = RunProgram({"evalbus", "render", run, "--episode", "1", "--camera", "front"});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_TRUE(ReadText(run / "episodes/0001/front.mp4") == video);
  EXPECT_TRUE(again.out.ends_with("run/episodes/0001/front.mp4\n")) << again.out;
  EXPECT_EQ(WithoutProgress(again.err), "");
  // The renderer is reported unless it is the default. With auto, a machine with a GPU renders with EGL.
  for (const std::string gl : {"egl", "egl-software", "auto"}) {
    const Result other = RunProgram(
        {"evalbus", "render", run, "--episode", "1", "--camera", "front", "--size", "64x48", "--gl", gl});
    EXPECT_EQ(other.code, 0) << other.err;
    const std::string err = WithoutProgress(other.err);
    const bool falls_back = err.starts_with("renders with osmesa (");
    EXPECT_TRUE(err.starts_with("renders with " + (gl == "auto" ? "egl" : gl) + " (") ||
                (gl == "auto" && falls_back))
        << err;
    EXPECT_EQ(err.ends_with("): there is no GPU that EGL can use\n"), falls_back) << err;
    // Mesa's software renderer gives equal bytes through both libraries.
    if (err.find("llvmpipe") == std::string::npos) continue;
    const std::string rendered = ReadText(run / "episodes/0001/front.mp4");
    EXPECT_EQ(
        RunProgram({"evalbus", "render", run, "--episode", "1", "--camera", "front", "--size", "64x48"}).code,
        0);
    EXPECT_TRUE(ReadText(run / "episodes/0001/front.mp4") == rendered) << gl;
  }
}

TEST(VideoRecording, SoftwareBesideAGpuIsAWarning) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const Result result = RunProgram({"evalbus", "run", ShortTask(folder.path(), 0.2), "--policy", "hold",
                                    "--episodes", "1", "--in-process", "--video", "front", "--out", run},
                                   {{}, [] { setenv("LD_PRELOAD", FAKE_GPU, 1); }});
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string warning = "images are rendered in software";
  EXPECT_NE(result.err.find("warning: " + warning), std::string::npos) << result.err;
  const nlohmann::json json = nlohmann::json::parse(ReadText(run / "run.json"));
  EXPECT_TRUE(json["renderer_warning"].get<std::string>().starts_with(warning)) << json["renderer_warning"];
  ASSERT_EQ(RunProgram({"evalbus", "report", run}).code, 0);
  EXPECT_NE(ReadText(run / "report.html").find("<th scope=\"row\">warning</th><td>" + warning),
            std::string::npos);
}

TEST(VideoRecording, CtrlCEndsItInOrderAndResumeMakesTheRest) {
  const TemporaryFolder folder;
  const std::vector<std::string> command = {"evalbus",  "run",          ShortTask(folder.path(), 0.2),
                                            "--policy", "hold",         "--episodes",
                                            "3",        "--in-process", "--video",
                                            "front",    "--out",        folder.path() / "run"};
  const fs::path run = folder.path() / "run";
  {
    Program launcher(command);
    ASSERT_TRUE(WaitFor([&] { return launcher.out().find("recording video of ") != std::string::npos; }))
        << launcher.err();
    launcher.Signal(SIGINT);
    EXPECT_EQ(launcher.Wait(), 2);
    EXPECT_TRUE(launcher.err().starts_with("error: stopped: ")) << launcher.err();
    EXPECT_NE(launcher.err().find(" no video yet; to record the rest, run the same command with --out "),
              std::string::npos)
        << launcher.err();
    EXPECT_EQ(launcher.out().find("videos  "), std::string::npos) << launcher.out();
  }
  for (const auto& entry : fs::recursive_directory_iterator(run)) {
    EXPECT_FALSE(entry.path().string().ends_with(".tmp")) << entry.path();
  }
  EXPECT_FALSE(fs::exists(run / "episodes/0002/front.mp4"));
  EXPECT_EQ(Episodes(run).size(), 3u);
  std::vector<std::string> resume = command;
  resume.push_back("--resume");
  EXPECT_EQ(RunProgram(resume).code, 0);
  EXPECT_TRUE(fs::exists(run / "episodes/0002/front.mp4"));
}

// `./run` adds a camera unless --video is given, so --video none gives no videos.
TEST(VideoRecording, NoneIsNoCamera) {
  const TemporaryFolder folder;
  const Result result =
      RunProgram({"evalbus", "run", ShortTask(folder.path(), 0.2), "--policy", "hold", "--episodes", "1",
                  "--in-process", "--video", "none", "--out", folder.path() / "run"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("videos"), std::string::npos) << result.out;
}

TEST(VideoRecording, MissingFfmpegCostsTheVideoAndNotTheResults) {
  const TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.2);
  const fs::path run = folder.path() / "run";
  const Result result = RunProgram({"evalbus", "run", task, "--policy", "hold", "--episodes", "1",
                                    "--in-process", "--video", "front", "--out", run},
                                   {{}, [] { setenv("EVALBUS_PATH", "/nonexistent", 1); }});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.err,
            "error: no video: videos require the ffmpeg program: install it with 'apt-get install ffmpeg' or "
            "'pip install imageio-ffmpeg'\n");
  EXPECT_TRUE(fs::exists(run / "episodes.jsonl"));
}

TEST(VideoRecording, TwoOfOneEpisodeAtOnceLeaveAWholeVideo) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run", video = run / "episodes/0000/front.mp4";
  Evaluate({ShortTask(folder.path(), 1), "--policy", "hold", "--episodes", "1", "--in-process"}, run);
  const std::vector<std::string> render = {"evalbus", "render", run,      "--camera",
                                           "front",   "--size", "160x120"};
  ASSERT_EQ(RunProgram(render).code, 0);
  const std::string whole = ReadText(video);
  ASSERT_GT(whole.size(), 1'000u);
  fs::remove(video);
  // On a loaded machine a program may finish before the test sees that it is active.
  const auto is_at_work = [](Program* program) {
    return [program] { return !ChildrenOf(program->pid(), "ffmpeg").empty() || !program->running(); };
  };
  Program first(render);
  ASSERT_TRUE(WaitFor(is_at_work(&first)));
  Program second(render);
  ASSERT_TRUE(WaitFor(is_at_work(&second)));
  EXPECT_EQ(first.Wait(), 0) << first.err();
  second.Signal(SIGKILL);
  second.Wait();
  EXPECT_TRUE(ReadText(video) == whole) << ReadText(video).size() << " bytes of " << whole.size();
}

void ExpectRefusedBeforeTheRun(const std::string& cameras, const std::string& error) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const Result result =
      RunProgram({"evalbus", "run", "lift_pot", "--in-process", "--video", cameras, "--out", run});
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.err, "error: " + error + "\n");
  EXPECT_FALSE(fs::exists(run));
}

TEST(VideoRecording, ACameraThatIsThereTwiceIsRefused) {
  ExpectRefusedBeforeTheRun(
      "front,front", "camera 'front' is given twice, or another camera has the same file name front.mp4");
}

TEST(VideoRecording, UnknownCameraIsRefusedBeforeTheRun) {
  ExpectRefusedBeforeTheRun(
      "nowhere",
      "no camera 'nowhere'; this scene has head, roboeval/external, front, overview, roboeval/head, "
      "roboeval/front, roboeval/left_wrist, left/hand/wrist, roboeval/right_wrist, right/hand/wrist");
}

}  // namespace evalbus::video_recording_test
