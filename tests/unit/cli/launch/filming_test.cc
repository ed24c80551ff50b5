#include "cli/launch/filming.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::launch {
namespace {

using testing::ElementsAre;

class Listener : public RunListener {
 public:
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override { done.push_back(episode["episode"]); }
  std::vector<int> done;
};

class FilmingTest : public testing::Test {
 protected:
  // Films are made by these words of the shell, with the episode's number as $1.
  std::unique_ptr<Filming> Make(const std::string& words) {
    std::filesystem::create_directories(folder_.path() / kLogsFolder);
    return std::make_unique<Filming>(
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
  Listener listener_;
};

TEST_F(FilmingTest, OneFilmAfterTheOtherAndAllIsPassedOn) {
  const auto filming = Make("echo $1 >> made");
  for (const int episode : {2, 0, 1}) filming->OnEpisodeDone(Episode(episode));
  EXPECT_EQ(filming->Finish(), 0u);
  EXPECT_EQ(Made(), "2\n0\n1\n");
  EXPECT_THAT(listener_.done, ElementsAre(2, 0, 1));
}

TEST_F(FilmingTest, WhatIsFilmedAlreadyIsLeft) {
  std::filesystem::create_directories(EpisodeFolder(folder_.path(), 0));
  std::ofstream(EpisodeFolder(folder_.path(), 0) / "front.mp4") << "film";
  const auto filming = Make("echo $1 >> made");
  filming->OnEpisodeDone(Episode(0));
  filming->OnEpisodeDone(Episode(1));
  EXPECT_EQ(filming->Finish(), 0u);
  EXPECT_EQ(Made(), "1\n");
}

TEST_F(FilmingTest, OneThatIsKilledIsMadeAgainOnce) {
  const auto filming = Make("echo $1 >> made; test -e again && exit 0; touch again; kill -9 $$");
  filming->OnEpisodeDone(Episode(0));
  filming->OnEpisodeDone(Episode(1));
  EXPECT_EQ(filming->Finish(), 0u);
  EXPECT_EQ(Made(), "0\n0\n1\n");
}

TEST_F(FilmingTest, WhatCannotBeFilmedIsSaidAndNothingElseTried) {
  const auto filming = Make("echo $1 >> made; echo 'error: no OSMesa' >&2; exit 2");
  filming->OnEpisodeDone(Episode(0));
  filming->OnEpisodeDone(Episode(1));
  try {
    filming->Finish();
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "no film: no OSMesa");
  }
  EXPECT_EQ(Made(), "0\n0\n");
}

TEST_F(FilmingTest, AnUnfinishedFilmLeavesNoFile) {
  {
    const auto filming = Make("mkdir -p episodes/0000; touch episodes/0000/front.partial.mp4; sleep 1000");
    filming->OnEpisodeDone(Episode(0));
    filming->Poll(SteadyTime{});
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    const auto partial = EpisodeFolder(folder_.path(), 0) / "front.partial.mp4";
    while (!std::filesystem::exists(partial) && std::chrono::steady_clock::now() < give_up)
      std::this_thread::yield();
    EXPECT_TRUE(std::filesystem::exists(partial));
  }
  EXPECT_TRUE(std::filesystem::is_empty(EpisodeFolder(folder_.path(), 0)));
}

}  // namespace
}  // namespace evalbus::launch
