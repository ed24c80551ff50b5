#include "base/help.h"

#include <gtest/gtest.h>

#include "base/suggestion.h"

namespace evalbus::help_test {

TEST(Help, LinesAreWrappedAndIndented) {
  EXPECT_EQ(Wrapped("one two three", 2, 9), "one two\n  three");
  EXPECT_EQ(Wrapped("one two three", 2, 10), "one two\n  three");
  EXPECT_EQ(Wrapped("one two three", 0, 13), "one two three");
  // A word that is longer than a line is put on a separate line.
  EXPECT_EQ(Wrapped("a abcdefgh b", 1, 5), "a\n abcdefgh\n b");
  // Characters are counted, not bytes.
  EXPECT_EQ(Wrapped("\u00b5\u00b5 \u00b5\u00b5", 0, 5), "\u00b5\u00b5 \u00b5\u00b5");
  EXPECT_EQ(Wrapped("", 4, 10), "");
}

TEST(Help, ALineBreakIsKeptInAList) {
  EXPECT_EQ(Wrapped("the first\nhalf", 0, 40), "the first half");
  EXPECT_EQ(Wrapped("a rate;\ndefault: 50", 1, 40), "a rate; default: 50");
  EXPECT_EQ(Wrapped("hold: rests\nlcm: on the bus", 1, 40), "hold: rests\n lcm: on the bus");
}

TEST(Help, AnOptionOfAChoiceIsNamed) {
  CLI::App app{"a program"};
  UseHelpFormatter(&app);
  int number = 3;
  app.add_option("--number", number, "a number")->check(CLI::Range(1, 9))->capture_default_str();
  CLI::Option_group* const choice = app.add_option_group("What to write");
  choice->add_option("--csv")->description("a table");
  choice->require_option(1);
  EXPECT_EQ(app.help(), R"(a program
Usage: [OPTIONS]

Options:
  -h,--help                 print this help and exit
  --number INT in [1 - 9]=3 a number

What to write (exactly one of these):
  --csv                     a table
)");
}

TEST(Suggestion, NamesTheNearestOrWhatIsExpected) {
  EXPECT_EQ(Suggestion("hed", {"front", "head"}), "; did you mean 'head'?");
  EXPECT_EQ(Suggestion("nowhere", {"head", "front"}), "; expected one of front, head");
  EXPECT_EQ(Suggestion("nowhere", {"head"}, "; there are two"), "; there are two");
  EXPECT_EQ(Suggestion("HEAD", {"head"}), "; did you mean 'head'?");
  EXPECT_EQ(Suggestion("shwo", {"show", "list"}),
            "; did you mean 'show'?");  // two swapped letters count as one mistake
  EXPECT_EQ(Suggestion("pos", {"base", "position_and_orientation", "position"}),
            "; did you mean 'position'?");
  EXPECT_EQ(Suggestion("po", {"base", "position"}), "; expected one of base, position");
  EXPECT_EQ(Suggestion("x", {}), "");
}

}  // namespace evalbus::help_test
