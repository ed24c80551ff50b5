// Films: number, size and time of their frames, and what happens when something goes wrong.
#include "viz/pictures/film.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/pictures/video_writer.h"

namespace evalbus::viz {
namespace {

namespace fs = std::filesystem;

constexpr FrameSize kSize{160, 120};
constexpr size_t kPixels = 160 * 120;

// The film as grey pictures, decoded by ffmpeg.
std::vector<std::vector<uint8_t>> Decode(const fs::path& film) {
  const std::string command =
      "ffmpeg -v quiet -i '" + film.string() + "' -fps_mode passthrough -f rawvideo -pix_fmt gray -";
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::vector<std::vector<uint8_t>> frames;
  std::vector<uint8_t> frame(kPixels);
  while (fread(frame.data(), 1, kPixels, pipe.get()) == kPixels) frames.push_back(frame);
  return frames;
}

std::string Probe(const fs::path& film) {
  const std::string command =
      "ffprobe -v error -select_streams v -show_entries "
      "stream=codec_name,width,height,pix_fmt,r_frame_rate -of csv=p=0 '" +
      film.string() + "'";
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  char line[200] = "";
  return fgets(line, sizeof line, pipe.get()) ? line : "";
}

std::string Bytes(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Mean difference of two pictures.
double Difference(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
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

class FilmTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = new Scene(LiftPotScene()); }
  static void TearDownTestSuite() { delete scene_; }

  const mjModel& visual() { return *scene_->visual; }
  // The pot is gone from this tick on.
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

TEST(FilmSchedule, FrameShowsTheLastStateAtOrBeforeItsTime) {
  for (const int64_t tick_us : {2000, 20000, 33333, 33334, 50000}) {
    std::vector<int64_t> times;
    for (int64_t k = 0; k <= 400; ++k) times.push_back(k * tick_us);
    const std::vector<size_t> shown = FilmSchedule(times);
    ASSERT_EQ(shown.size(), static_cast<size_t>(times.back() * 30 / 1000000 + 1)) << tick_us;
    for (size_t n = 0; n < shown.size(); ++n) {
      // floor(n / 30 s / tick), in whole numbers.
      ASSERT_EQ(shown[n], n * 1000000 / (30 * static_cast<size_t>(tick_us))) << tick_us << " frame " << n;
    }
  }
}

TEST(FilmSchedule, TicksMayBeMissing) {
  EXPECT_EQ(FilmSchedule({0, 20000, 100000}), (std::vector<size_t>{0, 1, 1, 2}));
  EXPECT_EQ(FilmSchedule({0}), std::vector<size_t>{0});
  EXPECT_TRUE(FilmSchedule({}).empty());
}

TEST_F(FilmTest, FramesHaveTheirTimeSizeAndNumber) {
  // 2.02 s; the pot vanishes at 0.62 s: frame 18 (0.600 s) shows it, frame 19 (0.633 s) does not.
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(102, 31));
  const auto films = FilmEpisode(log, {"front", "left/hand/wrist"}, kSize, log.parent_path());
  EXPECT_EQ(films, (std::vector<fs::path>{log.parent_path() / "front.mp4",
                                          log.parent_path() / "left_hand_wrist.mp4"}));
  for (const fs::path& film : films) {
    EXPECT_EQ(Probe(film), "h264,160,120,yuv420p,30/1\n");
    EXPECT_EQ(Decode(film).size(), 61u + kFilmHold);
  }
  const auto frames = Decode(films[0]);
  const double change = Difference(frames[18], frames[19]);
  EXPECT_GT(change, 2);
  for (size_t n = 1; n < 61; ++n) {
    if (n != 19) {
      EXPECT_LT(Difference(frames[n - 1], frames[n]), change / 2) << n;
    }
  }
  // Nothing else is left behind.
  EXPECT_EQ(std::distance(fs::directory_iterator(log.parent_path()), fs::directory_iterator()), 3);
}

TEST_F(FilmTest, EqualLogsGiveEqualBytes) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(20, 10));
  fs::create_directory(folder_.path() / "again");
  const fs::path a = FilmEpisode(log, {"front"}, kSize, log.parent_path())[0];
  const fs::path b = FilmEpisode(log, {"front"}, kSize, folder_.path() / "again")[0];
  EXPECT_GT(Bytes(a).size(), 1000u);
  EXPECT_TRUE(Bytes(a) == Bytes(b));
}

TEST_F(FilmTest, CutFilmPlaysUpToThere) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(151, 1000));
  const fs::path film = FilmEpisode(log, {"front"}, kSize, log.parent_path())[0];
  const auto whole = Decode(film);
  ASSERT_EQ(whole.size(), 91u + kFilmHold);
  const fs::path cut = folder_.path() / "cut.mp4";
  fs::copy_file(film, cut);
  fs::resize_file(cut, fs::file_size(film) * 3 / 4);
  const auto frames = Decode(cut);
  EXPECT_GE(frames.size(), 30u);
  ASSERT_LT(frames.size(), whole.size());
  for (size_t n = 0; n < 30; ++n) EXPECT_EQ(Difference(frames[n], whole[n]), 0) << n;
}

TEST_F(FilmTest, LogWithoutEndIsFilmedAsFarAsItGoes) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(51, 1000), "");
  EXPECT_EQ(Decode(FilmEpisode(log, {"front"}, kSize, log.parent_path())[0]).size(), 31u);
}

TEST_F(FilmTest, DamagedTimesNeitherStretchTheFilmNorEndIt) {
  const fs::path whole = WriteRun(folder_.path(), visual(), 20000, States(51, 1000));
  fs::create_directory(folder_.path() / "damaged");
  const fs::path damaged = folder_.path() / "damaged/events.lcmlog";
  EventLogReader reader(whole);
  EventLogWriter log(damaged);
  int64_t states = 0;
  for (LogEvent event; reader.Next(&event);) {
    std::vector<uint8_t> data(event.data.begin(), event.data.end());
    // sim_time_us follows the fingerprint, episode and tick.
    if (event.channel == channels::kState && states++ % 10 == 3) data[20] = states == 4 ? 0x01 : 0xC0;
    log.Write(event.channel, data, event.time_us);
  }
  log.Close();
  const fs::path film = FilmEpisode(damaged, {"front"}, kSize, damaged.parent_path())[0];
  EXPECT_EQ(Decode(film).size(), 31u + kFilmHold);
}

TEST_F(FilmTest, RunMayBeMoved) {
  fs::path log = WriteRun(folder_.path() / "here", visual(), 20000, States(2, 1000));
  fs::rename(folder_.path() / "here", folder_.path() / "there");
  log = folder_.path() / "there/episodes/0000/events.lcmlog";
  EXPECT_TRUE(fs::exists(FilmEpisode(log, {"front"}, kSize, log.parent_path())[0]));
}

TEST_F(FilmTest, OtherModelIsRefused) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(2, 1000));
  std::ofstream(folder_.path() / "model/visual.mjb", std::ios::app) << "x";
  EXPECT_THROW(FilmEpisode(log, {"front"}, kSize, log.parent_path()), InputError);
}

TEST_F(FilmTest, MistakesGiveOneLineAndNoFile) {
  const fs::path log = WriteRun(folder_.path(), visual(), 20000, States(2, 1000));
  const auto film = [&](const std::string& camera, FrameSize size) {
    return [=] { FilmEpisode(log, {"front", camera}, size, log.parent_path()); };
  };
  EXPECT_NE(MessageOf<InputError>(film("nowhere", kSize)).find("no camera 'nowhere'; this scene has head,"),
            std::string::npos);
  EXPECT_THROW(film("head", {161, 120})(), InputError);
  EXPECT_THROW(FilmEpisode(folder_.path() / "none.lcmlog", {"front"}, kSize, folder_.path()), InputError);
  const std::string path = getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  EXPECT_EQ(MessageOf<EnvironmentError>(film("head", kSize)),
            "films need the ffmpeg program: install it with 'apt-get install ffmpeg'");
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(std::distance(fs::directory_iterator(log.parent_path()), fs::directory_iterator()), 1);
}

TEST(VideoWriter, FfmpegThatFailsIsOneLine) {
  TemporaryFolder folder;
  VideoWriter video(folder.path() / "missing/film.mp4", kSize, 30);
  const Frame frame(kSize);
  const std::string message = MessageOf<EnvironmentError>([&] {
    for (int i = 0; i < 1000; ++i) video.Write(frame);
    video.Close();
  });
  EXPECT_NE(message.find("ffmpeg could not make"), std::string::npos) << message;
  EXPECT_NE(message.find("No such file or directory"), std::string::npos) << message;
}

TEST(VideoWriter, UnfinishedFilmIsThrownAway) {
  TemporaryFolder folder;
  {
    VideoWriter video(folder.path() / "film.mp4", kSize, 30);
    for (int i = 0; i < 40; ++i) video.Write(Frame(kSize));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace evalbus::viz
