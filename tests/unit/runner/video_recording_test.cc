#include "runner/video_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <thread>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/deadline.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::video_recording_test {

using testing::ElementsAre;

class VideoRecordingListener : public RunListener {
 public:
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override { done.push_back(episode["episode"]); }
  std::vector<int> done;
};

class VideoRecordingTest : public testing::Test {
 protected:
  // Videos are made by these shell commands, with the episode's number as $1.
  std::unique_ptr<VideoRecording> Make(const std::string& words) {
    std::filesystem::create_directories(folder_.path() / kLogsFolder);
    return std::make_unique<VideoRecording>(
        run_, std::vector<std::string>{"front"}, &listener_, [=, this](int episode) {
          return std::vector<std::string>{"/bin/sh", "-c", "cd " + folder_.path().string() + "; " + words,
                                          "sh", std::to_string(episode)};
        });
  }
  static nlohmann::ordered_json Episode(int number) { return {{"episode", number}}; }
  std::string Made() {
    std::ifstream stream(folder_.path() / "made");
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  TemporaryFolder folder_;
  const results::RunFolder run_ = results::RunFolder::OfWorker(folder_.path());
  VideoRecordingListener listener_;
};

TEST_F(VideoRecordingTest, OneVideoAfterTheOtherAndAllIsPassedOn) {
  const auto video_recording = Make("echo $1 >> made");
  for (const int episode : {2, 0, 1}) video_recording->OnEpisodeDone(Episode(episode));
  EXPECT_EQ(video_recording->Finish(), 0u);
  EXPECT_EQ(Made(), "2\n0\n1\n");
  EXPECT_THAT(listener_.done, ElementsAre(2, 0, 1));
}

TEST_F(VideoRecordingTest, ReportsProgress) {
  const auto video_recording = Make("test $1 = 1 || echo 'render [info] videos: 0.5'; echo $1 >> made");
  testing::internal::CaptureStdout();
  for (const int episode : {0, 1}) video_recording->OnEpisodeDone(Episode(episode));
  EXPECT_EQ(video_recording->Finish(), 0u);
  const std::string out = testing::internal::GetCapturedStdout();
  EXPECT_THAT(
      out,
      testing::MatchesRegex(
          "recording video of 2 episodes: (0|25) %\nrecording video of 2 episodes: 50 %, [0-9]+ s left\n"));
}

// During a run, rendering yields to the evaluation. After the run its priority is normal, because other
// programs could delay it for hours.
TEST_F(VideoRecordingTest, IsAtTheLowestPriorityWhileTheRunEvaluates) {
  const auto video_recording = Make("nice > nice$1; until test -e go; do sleep 0.01; done; echo $1 >> made");
  for (const int episode : {0, 1}) video_recording->OnEpisodeDone(Episode(episode));
  video_recording->Poll(SteadyTime{});
  const auto nice_of = [&](int episode) {
    std::ifstream stream(folder_.path() / ("nice" + std::to_string(episode)));
    std::string nice;
    std::getline(stream, nice);
    return nice;
  };
  const auto give_up = std::chrono::steady_clock::now() + kDeadline;
  while (nice_of(0).empty() && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
  EXPECT_EQ(nice_of(0), "19");
  std::ofstream(folder_.path() / "go");
  EXPECT_EQ(video_recording->Finish(), 0u);
  EXPECT_EQ(nice_of(1), std::to_string(getpriority(PRIO_PROCESS, 0)));
}

TEST_F(VideoRecordingTest, ExistingVideosAreKept) {
  std::filesystem::create_directories(EpisodeFolder(folder_.path(), 0));
  std::ofstream(EpisodeFolder(folder_.path(), 0) / "front.mp4") << "video";
  const auto video_recording = Make("echo $1 >> made");
  video_recording->OnEpisodeDone(Episode(0));
  video_recording->OnEpisodeDone(Episode(1));
  EXPECT_EQ(video_recording->Finish(), 0u);
  EXPECT_EQ(Made(), "1\n");
}

TEST_F(VideoRecordingTest, OneThatIsKilledIsMadeAgainOnce) {
  const auto video_recording = Make("echo $1 >> made; test -e again && exit 0; touch again; kill -9 $$");
  video_recording->OnEpisodeDone(Episode(0));
  video_recording->OnEpisodeDone(Episode(1));
  EXPECT_EQ(video_recording->Finish(), 0u);
  EXPECT_EQ(Made(), "0\n0\n1\n");
}

TEST_F(VideoRecordingTest, UnrecordableEpisodesAreReportedAndNotRetried) {
  const auto video_recording = Make("echo $1 >> made; echo 'error: no OSMesa' >&2; exit 2");
  video_recording->OnEpisodeDone(Episode(0));
  video_recording->OnEpisodeDone(Episode(1));
  try {
    video_recording->Finish();
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "no video: no OSMesa");
  }
  EXPECT_EQ(Made(), "0\n0\n");
}

TEST_F(VideoRecordingTest, AnEpisodeWithABadLogDoesNotAffectOtherVideos) {
  const auto video_recording =
      Make("echo $1 >> made; test $1 = 0 || exit 0; echo 'error: 0.lcmlog: damaged' >&2; exit 1");
  for (const int episode : {0, 1, 2}) video_recording->OnEpisodeDone(Episode(episode));
  try {
    video_recording->Finish();
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "no video: 0.lcmlog: damaged");
  }
  EXPECT_EQ(Made(), "0\n1\n2\n");
}

// The temporary files have the names that WriteWhole() gives them. A file that another process is writing is
// kept.
TEST_F(VideoRecordingTest, AnUnfinishedVideoLeavesNoFile) {
  const auto episode = EpisodeFolder(folder_.path(), 0);
  const std::string write =
      "mkdir -p episodes/0000; touch episodes/0000/front.mp4.1.tmp; "
      "touch episodes/0000/front.mp4.$$.tmp; touch begun; ";
  {
    const auto video_recording = Make(write + "sleep 1000");
    video_recording->OnEpisodeDone(Episode(0));
    video_recording->Poll(SteadyTime{});
    const auto give_up = std::chrono::steady_clock::now() + kDeadline;
    while (!std::filesystem::exists(folder_.path() / "begun") && std::chrono::steady_clock::now() < give_up)
      std::this_thread::yield();
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "begun"));
  }
  EXPECT_TRUE(std::filesystem::exists(episode / "front.mp4.1.tmp"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(episode), {}), 1);
  const auto video_recording = Make(write + "kill -9 $$");
  video_recording->OnEpisodeDone(Episode(0));
  EXPECT_THROW(video_recording->Finish(), EnvironmentError);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(episode), {}), 1);
}

}  // namespace evalbus::runner::video_recording_test
