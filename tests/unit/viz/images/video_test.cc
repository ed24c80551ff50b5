// Tests the number, the size and the timestamps of a video's frames, and error handling.
#include "viz/images/video.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/images/panel_video.h"
#include "viz/images/parallel_frame_renderer.h"
#include "viz/images/video_writer.h"

namespace evalbus::viz::video_test {

namespace fs = std::filesystem;

constexpr FrameSize kVideoSize{160, 120};
constexpr size_t kPixels = 160 * 120;

// Returns the video as gray images, decoded by ffmpeg.
std::vector<std::vector<uint8_t>> Decode(const fs::path& video) {
  const std::string command =
      "ffmpeg -v quiet -i '" + video.string() + "' -fps_mode passthrough -f rawvideo -pix_fmt gray -";
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::vector<std::vector<uint8_t>> frames;
  std::vector<uint8_t> frame(kPixels);
  while (fread(frame.data(), 1, kPixels, pipe.get()) == kPixels) frames.push_back(frame);
  return frames;
}

std::string Probe(const fs::path& video) {
  const std::string command =
      "ffprobe -v error -select_streams v -show_entries "
      "stream=codec_name,width,height,pix_fmt,r_frame_rate -of csv=p=0 '" +
      video.string() + "'";
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  char line[200] = "";
  return fgets(line, sizeof line, pipe.get()) ? line : "";
}

int NumFrames(const fs::path& video) {
  const std::string command =
      "ffprobe -v error -count_frames -select_streams v -show_entries stream=nb_read_frames -of csv=p=0 '" +
      video.string() + "'";
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  char line[200] = "";
  return fgets(line, sizeof line, pipe.get()) ? std::atoi(line) : -1;
}

std::string Bytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Returns the mean difference of two images.
double Difference(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

std::vector<fs::path> MakeVideo(const fs::path& log, const std::vector<std::string>& cameras, FrameSize size,
                                const fs::path& folder, const VideoOptions& options = {}) {
  ParallelFrameRenderer frame_renderer(size);
  return MakeLogVideos(log, cameras, &frame_renderer, folder, options);
}

template <class Error>
std::string MessageOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
  return "(no error)";
}

class VideoTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = new Scene(LiftPotScene()); }
  static void TearDownTestSuite() { delete scene_; }

  const mjModel& visual() { return *scene_->visual; }
  // Returns states in which the pot disappears at tick `gone_at`.
  std::vector<std::vector<double>> States(size_t num, size_t gone_at) {
    std::vector<std::vector<double>> states(num, HomeQpos(visual()));
    for (size_t i = gone_at; i < num; ++i) {
      states[i][static_cast<size_t>(QposIndex(visual(), "pot"))] = 50;
    }
    return states;
  }

  static inline Scene* scene_ = nullptr;
  TemporaryFolder folder_;
};

// Returns the frames of a video of a whole episode at normal speed.
std::vector<size_t> Schedule(const std::vector<int64_t>& times_us) {
  return VideoSchedule(times_us, FrameTimes({}, times_us.back()));
}

TEST(VideoSchedule, FrameShowsTheLastStateAtOrBeforeItsTime) {
  for (const int64_t tick_us : {2000, 20000, 33333, 33334, 50000}) {
    std::vector<int64_t> times;
    for (int64_t k = 0; k <= 400; ++k) times.push_back(k * tick_us);
    const std::vector<size_t> shown = Schedule(times);
    ASSERT_EQ(shown.size(), static_cast<size_t>(times.back() * 30 / 1000000 + 1)) << tick_us;
    for (size_t n = 0; n < shown.size(); ++n) {
      // The expected index is floor((n / 30 s) / tick), computed with integers.
      ASSERT_EQ(shown[n], n * 1000000 / (30 * static_cast<size_t>(tick_us))) << tick_us << " frame " << n;
    }
  }
}

TEST(VideoSchedule, TicksMayBeMissing) {
  EXPECT_EQ(Schedule({0, 20000, 100000}), (std::vector<size_t>{0, 1, 1, 2}));
  EXPECT_EQ(Schedule({0}), std::vector<size_t>{0});
}

TEST_F(VideoTest, FramesHaveTheirTimeSizeAndNumber) {
  // The video lasts 2.02 s. The pot disappears at 0.62 s, so frame 18 (0.600 s) shows it and frame 19 (0.633
  // s) does not.
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(102, 31));
  const auto videos = MakeVideo(log, {"front", "left/hand/wrist"}, kVideoSize, log.parent_path());
  EXPECT_EQ(videos, (std::vector<fs::path>{log.parent_path() / "front.mp4",
                                           log.parent_path() / "left_hand_wrist.mp4"}));
  for (const fs::path& video : videos) {
    EXPECT_EQ(Probe(video), "h264,160,120,yuv420p,30/1\n");
    EXPECT_EQ(Decode(video).size(), 61u + kVideoHold);
  }
  const auto frames = Decode(videos[0]);
  const double change = Difference(frames[18], frames[19]);
  EXPECT_GT(change, 2);
  for (size_t n = 1; n < 61; ++n) {
    if (n != 19) {
      EXPECT_LT(Difference(frames[n - 1], frames[n]), change / 2) << n;
    }
  }
  // No other file remains.
  EXPECT_EQ(std::distance(fs::directory_iterator(log.parent_path()), fs::directory_iterator()), 3);
}

TEST_F(VideoTest, EqualLogsGiveEqualBytes) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(20, 10));
  fs::create_directory(folder_.path() / "again");
  const fs::path a = MakeVideo(log, {"front"}, kVideoSize, log.parent_path())[0];
  const fs::path b = MakeVideo(log, {"front"}, kVideoSize, folder_.path() / "again")[0];
  EXPECT_GT(Bytes(a).size(), 1000u);
  EXPECT_TRUE(Bytes(a) == Bytes(b));
}

// A video ends with the word that tables show, which is the reason for the failure and not the event that
// ended the episode.
TEST_F(VideoTest, EndsWithTheOutcomeOfTheScore) {
  const auto video = [this](const std::string& name, const std::string& end_reason,
                            const std::string& failure_reason) {
    const fs::path run = folder_.path() / name;
    const fs::path log = WriteRun(run, visual(), 20000, States(3, 10), end_reason);
    const fs::path scored = run / "scored.lcmlog";
    {
      EventLogReader reader(log);
      EventLogWriter writer(scored);
      for (LogEvent event; reader.Next(&event);) writer.Write(event.channel, event.data, event.time_us);
      episode_summary_t summary{};
      summary.end_reason = end_reason;
      summary.failure_reason = failure_reason;
      if (!failure_reason.empty()) writer.Write(channels::kEpisodeSummary.name, Encode(summary), 60000);
      writer.Close();
    }
    return Bytes(MakeVideo(scored, {"front"}, kVideoSize, run)[0]);
  };
  const std::string slipped = video("a", "time_limit", "grasp_slip");
  EXPECT_TRUE(slipped == video("b", "grasp_slip", ""));
  EXPECT_FALSE(slipped == video("c", "time_limit", ""));
}

TEST_F(VideoTest, FullLayoutIsOneVideoWithTwoSecondsOfEndCard) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(51, 1000));
  VideoOptions options;
  options.layout = VideoLayout::kFull;
  const auto videos = MakeVideo(log, {}, {640, 360}, log.parent_path(), options);
  EXPECT_EQ(videos, (std::vector<fs::path>{log.parent_path() / "full.mp4"}));
  EXPECT_EQ(Probe(videos[0]), "h264,640,360,yuv420p,30/1\n");
  EXPECT_EQ(NumFrames(videos[0]), 31 + kPanelHold);
  const std::string first = Bytes(videos[0]);
  MakeVideo(log, {}, {640, 360}, log.parent_path(), options);
  EXPECT_TRUE(first == Bytes(videos[0]));
  EXPECT_EQ(MessageOf<InputError>([&] { MakeVideo(log, {}, kVideoSize, log.parent_path(), options); }),
            "--size 160x120: videos with panels require at least 640x360");
  EXPECT_EQ(MessageOf<InputError>([&] {
              MakeVideo(log, {"head", "front", "overview", "left/hand/wrist", "right/hand/wrist"}, {640, 360},
                        log.parent_path(), options);
            }),
            "the full layout shows at most 4 cameras, the first one large; got 5");
  EXPECT_EQ(MessageOf<InputError>([] { ParseVideoLayout("big"); }), "--layout big: expected plain or full");
}

// Longer episodes continue while finished ones hold their last image.
TEST_F(VideoTest, GridAndPairLastAsLongAsTheLongest) {
  const fs::path a = WriteRun(folder_.path() / "a", visual(), 20000, States(51, 1000));
  const fs::path b = WriteRun(folder_.path() / "b", visual(), 20000, States(21, 1000), "time_limit");
  std::vector<VideoEpisode> episodes;
  for (const fs::path& log : {a, b}) episodes.push_back(ReadVideoEpisodes(log, {}, "expert")[0]);
  EXPECT_EQ(episodes[0].states.size(), 31u);
  EXPECT_EQ(episodes[1].states.size(), 13u);
  JointVideoOptions options;
  options.size = {640, 360};
  options.shape = {2, 1};
  MakeGridVideo(episodes, options, folder_.path() / "grid.mp4");
  EXPECT_EQ(NumFrames(folder_.path() / "grid.mp4"), 31 + kPanelHold);
  MakePairVideo(episodes, options, folder_.path() / "pair.mp4");
  EXPECT_EQ(NumFrames(folder_.path() / "pair.mp4"), 31 + kPanelHold);
  EXPECT_EQ(MessageOf<InputError>([&] { ReadVideoEpisodes(a, {3}, ""); }),
            a.string() + " has no episode 3; it has 0");
  options.camera = "nowhere";
  EXPECT_THROW(MakeGridVideo(episodes, options, folder_.path() / "none.mp4"), InputError);
  EXPECT_FALSE(fs::exists(folder_.path() / "none.mp4"));
}

// There are 31 frames of 1 s and 30 held ones: 2 s at 10 frames per second.
TEST_F(VideoTest, GifAndWebpAreOfTheSameLength) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(51, 1000));
  VideoOptions options;
  options.file = folder_.path() / "video.gif";
  const fs::path gif = MakeVideo(log, {"front"}, kVideoSize, log.parent_path(), options)[0];
  EXPECT_EQ(Bytes(gif).substr(0, 6), "GIF89a");
  EXPECT_NEAR(NumFrames(gif), 20, 1);
  options.file = folder_.path() / "video.webp";
  const std::string webp = Bytes(MakeVideo(log, {"front"}, kVideoSize, log.parent_path(), options)[0]);
  EXPECT_EQ(webp.substr(0, 4), "RIFF");
  EXPECT_EQ(webp.substr(8, 4), "WEBP");
  // The size in its header is correct; an animation that repeats forever has 0 after its background color.
  uint32_t size = 0;
  std::memcpy(&size, webp.data() + 4, 4);
  EXPECT_EQ(size + 8, webp.size());
  const size_t anim = webp.find("ANIM");
  ASSERT_NE(anim, std::string::npos);
  EXPECT_EQ(webp.substr(anim + 12, 2), std::string(2, '\0'));
  options.file = folder_.path() / "video.avi";
  EXPECT_EQ(MessageOf<InputError>([&] { MakeVideo(log, {"front"}, kVideoSize, log.parent_path(), options); }),
            "a video's name must end in .mp4, .gif or .webp, not in '.avi'");
  options.file = folder_.path() / "video.gif";
  EXPECT_EQ(MessageOf<InputError>([&] {
              MakeVideo(log, {"front", "head"}, kVideoSize, log.parent_path(), options);
            }),
            "2 videos cannot be written to one file: " + options.file.string());
}

TEST_F(VideoTest, CutVideoPlaysUpToThere) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(151, 1000));
  const fs::path video = MakeVideo(log, {"front"}, kVideoSize, log.parent_path())[0];
  const auto whole = Decode(video);
  ASSERT_EQ(whole.size(), 91u + kVideoHold);
  const fs::path cut = folder_.path() / "cut.mp4";
  fs::copy_file(video, cut);
  fs::resize_file(cut, fs::file_size(video) * 3 / 4);
  const auto frames = Decode(cut);
  EXPECT_GE(frames.size(), 30u);
  ASSERT_LT(frames.size(), whole.size());
  for (size_t n = 0; n < 30; ++n) EXPECT_EQ(Difference(frames[n], whole[n]), 0) << n;
}

TEST_F(VideoTest, LogWithoutEndIsRecordedAsFarAsItGoes) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(51, 1000), "");
  EXPECT_EQ(Decode(MakeVideo(log, {"front"}, kVideoSize, log.parent_path())[0]).size(), 31u);
}

// Like a log that lcm-logger writes during a run, this log contains several episodes.
TEST_F(VideoTest, EveryEpisodeOfALogHasAVideo) {
  const fs::path one = WriteRun(folder_.path(), visual(), 20000, States(51, 1000));
  fs::create_directory(folder_.path() / "all");
  const fs::path log = folder_.path() / "all/events.lcmlog";
  EventLogWriter writer(log);
  for (const auto& [episode, states] : {std::pair(4, 51), std::pair(5, 26), std::pair(5, 11)}) {
    EventLogReader reader(one);
    int received = 0;
    for (LogEvent event; reader.Next(&event);) {
      if (event.channel == channels::kState && ++received > states) continue;
      std::vector<uint8_t> data(event.data.begin(), event.data.end());
      // The episode follows the fingerprint and the session.
      if (event.channel != channels::kModel) data[19] = static_cast<uint8_t>(episode);
      writer.Write(event.channel, data, event.time_us);
      // EPISODE_BEGIN is repeated until all components are ready.
      if (event.channel == channels::kEpisodeBegin) writer.Write(event.channel, data, event.time_us);
    }
  }
  writer.Close();
  const fs::path folder = log.parent_path();
  std::vector<double> progress;
  VideoOptions options;
  options.progress = [&](double share) { progress.push_back(share); };
  const auto videos = MakeVideo(log, {"front"}, kVideoSize, folder, options);
  EXPECT_EQ(videos,
            (std::vector<fs::path>{folder / "episode_0004_front.mp4", folder / "episode_0005_front.mp4",
                                   folder / "episode_0005_2_front.mp4"}));
  ASSERT_EQ(videos.size(), 3u);
  EXPECT_EQ(Decode(videos[0]).size(), 31u + kVideoHold);
  EXPECT_EQ(Decode(videos[1]).size(), 16u + kVideoHold);
  EXPECT_EQ(Decode(videos[2]).size(), 7u + kVideoHold);
  EXPECT_TRUE(std::ranges::is_sorted(progress));
  EXPECT_EQ(progress.back(), 1);
  // The first video has 31 frames and the held one.
  EXPECT_NEAR(progress[31], 1. / 3, 1e-9) << "the end of the first";

  for (const fs::path& video : videos) fs::remove(video);
  options.episodes = {4};
  EXPECT_EQ(MakeVideo(log, {"front"}, kVideoSize, folder, options),
            (std::vector<fs::path>{folder / "episode_0004_front.mp4"}));
  options.episodes = {7};
  EXPECT_EQ(MessageOf<InputError>([&] { MakeVideo(log, {"front"}, kVideoSize, folder, options); }),
            log.string() + " has no episode 7; it has 4, 5");
}

TEST_F(VideoTest, DamagedTimesNeitherStretchTheVideoNorEndIt) {
  const fs::path whole = WriteRun(folder_.path(), visual(), 20000, States(51, 1000));
  fs::create_directory(folder_.path() / "damaged");
  const fs::path damaged = folder_.path() / "damaged/events.lcmlog";
  EventLogReader reader(whole);
  EventLogWriter log(damaged);
  int64_t states = 0;
  for (LogEvent event; reader.Next(&event);) {
    std::vector<uint8_t> data(event.data.begin(), event.data.end());
    // sim_time_us follows the fingerprint, session, episode, attempt and tick.
    if (event.channel == channels::kState && states++ % 10 == 3) data[32] = states == 4 ? 0x01 : 0xC0;
    log.Write(event.channel, data, event.time_us);
  }
  log.Close();
  const fs::path video = MakeVideo(damaged, {"front"}, kVideoSize, damaged.parent_path())[0];
  EXPECT_EQ(Decode(video).size(), 31u + kVideoHold);
}

TEST_F(VideoTest, RunMayBeMoved) {
  fs::path log = WriteRun(folder_.path() / "here", visual(), 20000, States(2, 1000));
  fs::rename(folder_.path() / "here", folder_.path() / "there");
  log = folder_.path() / "there/episodes/0000/events.lcmlog";
  EXPECT_TRUE(fs::exists(MakeVideo(log, {"front"}, kVideoSize, log.parent_path())[0]));
}

TEST_F(VideoTest, OtherModelIsRefused) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(2, 1000));
  std::ofstream(folder_.path() / "model/visual.mjb", std::ios::app) << "x";
  EXPECT_THROW(MakeVideo(log, {"front"}, kVideoSize, log.parent_path()), InputError);
}

TEST_F(VideoTest, MistakesGiveOneLineAndNoFile) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(2, 1000));
  const auto video = [&](const std::string& camera, FrameSize size) {
    return [=] { MakeVideo(log, {"front", camera}, size, log.parent_path()); };
  };
  EXPECT_NE(
      MessageOf<InputError>(video("nowhere", kVideoSize)).find("no camera 'nowhere'; this scene has head,"),
      std::string::npos);
  EXPECT_THROW(video("head", {161, 120})(), InputError);
  EXPECT_THROW(MakeVideo(folder_.path() / "none.lcmlog", {"front"}, kVideoSize, folder_.path()), InputError);
  setenv("EVALBUS_PATH", "/nonexistent", 1);
  EXPECT_EQ(MessageOf<EnvironmentError>(video("head", kVideoSize)),
            "videos require the ffmpeg program: install it with 'apt-get install ffmpeg' or 'pip install "
            "imageio-ffmpeg'");
  unsetenv("EVALBUS_PATH");
  EXPECT_EQ(std::distance(fs::directory_iterator(log.parent_path()), fs::directory_iterator()), 1);
}

TEST_F(VideoTest, ACameraIsRecordedOnce) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(2, 1000));
  EXPECT_EQ(MessageOf<InputError>([&] {
              MakeVideo(log, {"front", "front"}, kVideoSize, log.parent_path());
            }),
            "camera 'front' is given twice, or another camera has the same file name front.mp4");
  EXPECT_EQ(std::distance(fs::directory_iterator(log.parent_path()), fs::directory_iterator()), 1);
}

// Replaces ffmpeg by a program that executes these shell commands.
class FakeFfmpeg : public testing::Test {
 protected:
  void Publish(const std::string& words) {
    const fs::path program = folder_.path() / "bin/ffmpeg";
    fs::create_directories(program.parent_path());
    std::ofstream(program) << "#!/bin/sh\n" << words << "\n";
    fs::permissions(program, fs::perms::owner_all);
    setenv("EVALBUS_PATH", program.parent_path().c_str(), 1);
  }
  ~FakeFfmpeg() override { unsetenv("EVALBUS_PATH"); }
  // Makes a video of 1000 frames, and returns the error message.
  template <class Error>
  std::string MakeVideo(std::chrono::milliseconds timeout = std::chrono::seconds(60)) {
    return MessageOf<Error>([&] {
      VideoWriter video(video_, kVideoSize, 30, timeout);
      for (int i = 0; i < 1000; ++i) video.Write(Frame(kVideoSize));
      video.Close();
    });
  }

  TemporaryFolder folder_;
  const fs::path video_ = folder_.path() / "video.mp4";
};

TEST_F(FakeFfmpeg, ThatFailsIsOneLine) {
  Publish("echo 'no encoder' >&2; echo 'and more' >&2; exit 1");
  EXPECT_EQ(MakeVideo<EnvironmentError>(), "ffmpeg could not make " + video_.string() + ": no encoder");
}

TEST_F(FakeFfmpeg, ThatHangsIsEnded) {
  const std::string hangs = "ffmpeg could not make " + video_.string() + ": it hung: no progress for 0.5 s";
  Publish("kill -STOP $$");
  EXPECT_EQ(MakeVideo<EnvironmentError>(std::chrono::milliseconds(500)), hangs);
  // ffmpeg is killed even if it has accepted all frames.
  Publish("cat >/dev/null; kill -STOP $$");
  EXPECT_EQ(MakeVideo<EnvironmentError>(std::chrono::milliseconds(500)), hangs);
  EXPECT_FALSE(fs::exists(video_));
}

// Each process writes its own temporary file until the video is complete.
TEST(VideoWriter, TwoOfOneNameDoNotMix) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "video.mp4";
  const auto frames = [](VideoWriter* video, int n) {
    for (int i = 0; i < n; ++i) video->Write(Frame(kVideoSize));
  };
  VideoWriter first(file, kVideoSize, 30);
  frames(&first, 20);
  {
    VideoWriter second(file, kVideoSize, 30);
    frames(&second, 1);
    frames(&first, 10);
  }
  VideoWriter third(file, kVideoSize, 30);
  frames(&third, 5);
  first.Close();
  EXPECT_EQ(Decode(file).size(), 30u);
  third.Close();
  EXPECT_EQ(Decode(file).size(), 5u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(VideoWriter, AFolderThatIsGoneIsOneLine) {
  TemporaryFolder folder;
  VideoWriter video(folder.path() / "missing/video.mp4", kVideoSize, 30);
  video.Write(Frame(kVideoSize));
  EXPECT_EQ(MessageOf<InputError>([&] { video.Close(); }),
            "cannot write " + (folder.path() / "missing/video.mp4").string() + ": No such file or directory");
}

TEST(VideoWriter, UnfinishedVideoIsThrownAway) {
  TemporaryFolder folder;
  {
    VideoWriter video(folder.path() / "video.mp4", kVideoSize, 30);
    for (int i = 0; i < 40; ++i) video.Write(Frame(kVideoSize));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace evalbus::viz::video_test
