#include "runner/progress_line.h"

#include <gtest/gtest.h>

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

}  // namespace evalbus::runner::progress_line_test
