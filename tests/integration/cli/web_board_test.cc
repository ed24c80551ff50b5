// Tests evalbus web in a browser: the overview of a plan, and lists of thousands of episodes.
#include "tests/integration/harness.h"
#include "tests/unit/results/run_folders.h"

namespace evalbus::web_board_test {

namespace fs = std::filesystem;

// The script contains the expected values.
TEST(WebBoard, FiltersAcceptWhatTheyDescribe) {
  const Result result = RunProgram({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/tests/browser/check_filter.py"});
  if (result.code == 77) GTEST_SKIP() << result.out;
  EXPECT_EQ(result.code, 0) << result.out << result.err;
}

// A run with this many episodes; its files exist, but its logs do not.
void WriteLargeRun(const fs::path& folder, int episodes) {
  std::vector<nlohmann::ordered_json> lines;
  for (int i = 0; i < episodes; ++i)
    lines.push_back(results::EpisodeLine(i, i % 3 != 0, {{"slip_count", i % 5}}));
  results::WriteRun(folder, results::RunInfo(episodes), lines);
  results::WriteFile(folder / "summary.json", "{}");
}

// check_board.py documents what is compared.
TEST(WebBoard, BrowserShowsAPlanAndManyEpisodes) {
  const TemporaryFolder folder;
  const fs::path plan = folder.path() / "plan", large = folder.path() / "large";
  results::WriteFile(folder.path() / "plan.yaml",
                     "policies: [expert, {name: dropping, policy: 'flawed_expert:drop'}]\n"
                     "tasks: [lift_pot/position]\nepisodes: 4\nseed: 1\n");
  const Result run = RunProgram({"evalbus", "run", folder.path() / "plan.yaml", "--out", plan});
  ASSERT_EQ(run.code, 0) << run.err;
  WriteLargeRun(large, 5000);
  const Result result = RunProgram({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/tests/browser/check_board.py",
                                    EVALBUS_BINARY_DIR "/bin/evalbus", plan, large});
  if (result.code == 77) GTEST_SKIP() << result.out;
  EXPECT_EQ(result.code, 0) << result.out << result.err;
}

}  // namespace evalbus::web_board_test
