#include "runner/progress_line.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::progress_line_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

class ProgressLineTest : public testing::Test {
 protected:
  ~ProgressLineTest() override { std::fclose(out_); }
  std::string Text() const {
    std::string text(static_cast<size_t>(std::ftell(out_)), '\0');
    std::rewind(out_);
    EXPECT_EQ(std::fread(text.data(), 1, text.size(), out_), text.size());
    return text;
  }

  std::FILE* const out_ = std::tmpfile();
  const ProgressLine::Time began_{seconds(1000)};
};

TEST_F(ProgressLineTest, IsALineNowAndThenWhereItIsNoTerminal) {
  ProgressLine line(50, "exporting", out_, false, began_);
  for (int tenths = 0; tenths <= 250; ++tenths) {
    line.Show(0.2 * tenths, began_ + milliseconds(100 * tenths));
    line.Clear();
  }
  EXPECT_EQ(Text(), "exporting 50 episodes: 40 %, 15 s left\nexporting 50 episodes: 80 %, 5 s left\n");
}

TEST_F(ProgressLineTest, IsNothingWhereItTakesNoTime) {
  {
    ProgressLine line(50, "exporting", out_, false, began_);
    for (int second = 0; second < 10; ++second) line.Show(5 * second, began_ + seconds(second));
  }
  EXPECT_EQ(Text(), "");
}

TEST_F(ProgressLineTest, IsInPlaceOnATerminal) {
  {
    ProgressLine line(4, "exporting", out_, true, began_);
    line.Show(0, began_);
    line.Show(1, began_ + seconds(1));
    line.Show(1, began_ + milliseconds(1001));
    line.Clear();
    line.Clear();
  }
  EXPECT_EQ(Text(), "\x1b[Kexporting 4 episodes: 25 %, 3 s left\r\x1b[K");
}

class JobsProgressTest : public ProgressLineTest {
 protected:
  void Append(const std::string& run, const std::string& text) {
    std::filesystem::create_directories(folder_.path() / run);
    std::ofstream(folder_.path() / run / "episodes.jsonl", std::ios::app) << text;
  }
  std::vector<std::filesystem::path> runs() const { return {folder_.path() / "a", folder_.path() / "b"}; }

  TemporaryFolder folder_;
};

TEST_F(JobsProgressTest, CountsJobsAndEpisodesFiveTimesASecond) {
  {
    JobsProgress progress(2, "runs", runs(), 3, out_, true, began_);
    progress.Show(0, began_);
    Append("a", "{}\n{}\n{");  // the third line is not yet complete
    progress.Show(0, began_ + milliseconds(100));
    progress.Show(0, began_ + milliseconds(200));
    Append("a", "}\n");
    Append("b", "{}\n");
    progress.Clear();
    progress.Show(1, began_ + seconds(65));
  }
  EXPECT_EQ(Text(),
            "\x1b[K0 of 2 runs, 0 of 6 episodes, 0 s\r"
            "\x1b[K0 of 2 runs, 2 of 6 episodes, 0 s\r\x1b[K"
            "\x1b[K1 of 2 runs, 4 of 6 episodes, 1:05 min\r\x1b[K");
}

TEST_F(JobsProgressTest, IsNothingWithoutTerminal) {
  JobsProgress(2, "runs", runs(), 3, out_, false, began_).Show(1, began_ + seconds(20));
  EXPECT_EQ(Text(), "");
}

}  // namespace evalbus::runner::progress_line_test
