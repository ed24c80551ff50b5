// Files of a run folder are valid and complete, even if texts are not UTF-8 or the run is killed.
#include "results/run_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <fstream>
#include <optional>
#include <set>
#include <thread>

#include "base/errors.h"
#include "base/json_file.h"
#include "results/episode_json.h"
#include "results/rescorer.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::run_folder_test {

namespace fs = std::filesystem;

// "Stöße" in Latin-1.
constexpr char kLatin1[] =
    "St\xF6\xDF"
    "e";

TEST(RunFolder, WordsThatAreNoUtf8AreWrittenWithReplacements) {
  TemporaryFolder folder;
  const RunFolder run = RunFolder::OfWorker(folder.path());
  episode_summary_t summary{};
  summary.end_reason = "policy_error";
  summary.end_detail = kLatin1;
  run.AddEpisode(0, EpisodeJson("task", "base", summary));
  const auto episodes = EpisodeLines(folder.path() / kEpisodesJsonl).Next();
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_EQ(episodes[0]["end_detail"],
            "St\uFFFD\uFFFD"
            "e");
}

TEST(RunFolder, EpisodesAreNumberedByIntegers) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "episodes.jsonl") << "{\"episode\": -1e308}\n";
  EXPECT_THROW(EpisodeLines(folder.path() / kEpisodesJsonl).Next(), InputError);
}

// Returns the names of everything in a folder and its subfolders.
std::set<std::string> Entries(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.insert(entry.path().lexically_relative(folder));
  }
  return names;
}

void Touch(const fs::path& file) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << "x";
}

TEST(RunFolder, OnlyWhatIsOursAndUnfinishedIsRemoved) {
  TemporaryFolder folder;
  const std::set<std::string> others = {"notes.tmp",
                                        "notes.1.tmp",
                                        "run.json.tmp",
                                        "run.json.old.tmp",
                                        "front.mp4.7.tmp",
                                        "mine",
                                        "mine/summary.json.7.tmp",
                                        "episodes",
                                        "episodes/notes",
                                        "episodes/notes/summary.json.7.tmp",
                                        "episodes/0001",
                                        "episodes/0001/events.lcmlog"};
  for (const std::string& name : others) {
    if (name.find('.') != std::string::npos) Touch(folder.path() / name);
  }
  for (const char* name : {"run.json.12.tmp", "model/physics.mjb.12.tmp", "episodes/0001/summary.json.12.tmp",
                           "episodes/0001/front.mp4.12.tmp", "episodes/0000/events.lcmlog",
                           "episodes/0001.partial/events.lcmlog", "episodes/0002.partial/events.lcmlog"}) {
    Touch(folder.path() / name);
  }
  RunFolder::OfWorker(folder.path()).DiscardAllBut({1});
  std::set<std::string> expected = others;
  expected.insert("model");
  EXPECT_EQ(Entries(folder.path()), expected);
}

TEST(RunFolder, OneThatIsTakenAwayLeavesWhatIsNotItsOwn) {
  TemporaryFolder folder;
  { RunFolder::OfRun(folder.path() / "a/b", "", false).Remove(); }
  EXPECT_EQ(Entries(folder.path()), std::set<std::string>{});
  {
    const RunFolder run = RunFolder::OfRun(folder.path() / "a/b", "", false);
    run.WriteJson(kRunJson, {{"seed", 1}});
    Touch(run.path() / "model/physics.mjb");
    Touch(run.path() / "notes");
    run.Remove();
  }
  EXPECT_EQ(Entries(folder.path()), (std::set<std::string>{"a", "a/b", "a/b/notes"}));
}

TEST(RunFolder, ToOpenOneChangesNothingInIt) {
  TemporaryFolder folder;
  for (const char* name : {"run.json", "run.json.12.tmp", "episodes/0000/events.lcmlog",
                           "episodes/0001.partial/events.lcmlog", "logs/sim.log"}) {
    Touch(folder.path() / name);
  }
  const auto before = Entries(folder.path());
  RunFolder::OfRun(folder.path(), "", true);
  EXPECT_EQ(Entries(folder.path()), before);
}

// A run writes its models before run.json, and may be killed at any time.
TEST(RunFolder, OneThatWasKilledBeforeRunJsonWasWrittenIsResumed) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  fs::create_directories(run / kLogsFolder);
  fs::create_directories(run / kModelFolder);
  for (const char* file : {"model/physics.mjb.node7-12.tmp", "model/scene.xml", "model/physics.mjb",
                           "model/visual.mjb", "run.json.node7-12.tmp"}) {
    Touch(run / file);
    EXPECT_NO_THROW(RunFolder::OfRun(run, "", true)) << file;
    EXPECT_THROW(RunFolder::OfRun(run, "", false), InputError) << file;
  }
  Touch(run / kModelFolder / "thesis.tex");
  EXPECT_THROW(RunFolder::OfRun(run, "", true), InputError);
}

TEST(RunFolder, ManyThatBeginInOneSecondHaveAFolderEach) {
  TemporaryFolder folder;
  const fs::path back = fs::current_path();
  fs::current_path(folder.path());
  constexpr int kRuns = 20;
  std::vector<std::optional<RunFolder>> runs(kRuns);
  {
    std::vector<std::thread> threads;
    for (auto& run : runs) threads.emplace_back([&run] { run.emplace(RunFolder::OfRun("", "name", false)); });
    for (std::thread& thread : threads) thread.join();
  }
  std::set<fs::path> paths;
  for (const auto& run : runs) paths.insert(run->path());
  EXPECT_EQ(paths.size(), size_t{kRuns});
  for (const fs::path& path : paths) {
    EXPECT_EQ(path.parent_path(), fs::current_path() / "runs");
    EXPECT_TRUE(path.filename().string().starts_with("name-"));
  }
  fs::current_path(back);
}

TEST(RunFolder, IsCalledByItsFolderHoweverThatIsWritten) {
  EXPECT_EQ(NameOfRun("runs/a"), "a");
  EXPECT_EQ(NameOfRun("runs/a/"), "a");
  EXPECT_EQ(NameOfRun("runs/a/."), "a");
  EXPECT_EQ(NameOfRun("runs/a/b/.."), "a");
  EXPECT_EQ(NameOfRun("."), fs::current_path().filename());
}

TEST(RunFolder, IsInUseWhileAProcessEvaluatesIntoItOrItsSuite) {
  const TemporaryFolder folder;
  const fs::path suite = folder.path() / "suite", run = suite / "lift_pot-base";
  EXPECT_FALSE(IsInUse(run));  // does not exist
  {
    const RunFolder open = RunFolder::OfRun(run, "run", false);
    EXPECT_TRUE(IsInUse(run));
    EXPECT_FALSE(IsInUse(suite));
  }
  EXPECT_FALSE(IsInUse(run));
  std::ofstream(suite / "suite.json") << R"({"runs": ["lift_pot-base"]})";
  const RunFolder open = RunFolder::OfSuite(suite, "suite", true);
  EXPECT_TRUE(IsInUse(run));
}

TEST(RunFolder, ALineThatDoesNotFitLeavesNothing) {
  TemporaryFolder folder;
  const RunFolder run = RunFolder::OfWorker(folder.path());
  run.AddEpisode(0, {{"episode", 0}});
  const auto size = fs::file_size(folder.path() / kEpisodesJsonl);
  const auto no_signal = signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  // RLIMIT_FSIZE acts like a full disk: only a part of the data is written. The episode's own summary, which
  // has almost no indentation, fits within the limit, but another line does not.
  const nlohmann::ordered_json line = {{"episode", 1}, {"text", std::string(200, 'x')}};
  const rlimit small{ToText(line, 2).size() + 1, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(run.AddEpisode(1, line), EnvironmentError);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, no_signal);
  EXPECT_EQ(fs::file_size(folder.path() / kEpisodesJsonl), size);
}

TEST(Rescore, WordsThatAreNoUtf8AreCompared) {
  episode_summary_t before{}, after{};
  after.end_detail = kLatin1;
  const auto differences = Differences(before, after);
  ASSERT_EQ(differences.size(), 1u);
  EXPECT_EQ(differences[0].after,
            "\"St\uFFFD\uFFFD"
            "e\"");
}

}  // namespace evalbus::results::run_folder_test
