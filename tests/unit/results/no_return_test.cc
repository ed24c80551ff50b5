#include "results/no_return.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::no_return_test {

using Kind = NoReturn::Kind;

TEST(NoReturn, IsReadAsItWasWritten) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / kEpisodesFolder);
  EXPECT_TRUE(ReadNoReturns(folder.path()).empty());
  AddNoReturns(folder.path(), {{3, {Kind::kNever, 0, 0, true}}, {12, {Kind::kOutOfTime, 700, 14, false}}});
  AddNoReturns(folder.path(), {{3, {Kind::kLost, 181, 3.62, true}}});
  const NoReturns points = ReadNoReturns(folder.path());
  ASSERT_EQ(points.size(), 2);
  EXPECT_EQ(points.at(3).kind, Kind::kLost);
  EXPECT_EQ(points.at(3).tick, 181);
  EXPECT_EQ(points.at(3).time_s, 3.62);
  EXPECT_TRUE(points.at(3).is_monotone);
  EXPECT_EQ(points.at(12).kind, Kind::kOutOfTime);
  EXPECT_FALSE(points.at(12).is_monotone);
}

TEST(NoReturn, EveryKindHasASentence) {
  EXPECT_EQ(NoReturnText({Kind::kLost, 181, 3.62, true}),
            "Point of no return at 3.62 s: from later ticks, the expert fails, even with more time.");
  EXPECT_EQ(NoReturnText({Kind::kOutOfTime, 700, 14, false}),
            "Point of no return at 14.00 s: from later ticks, the expert has too little time. It also fails "
            "from some "
            "earlier ticks.");
  EXPECT_EQ(NoReturnText({Kind::kNever, 0, 0, true}),
            "No point of no return: the expert fails even from the start.");
  EXPECT_EQ(NoReturnText({Kind::kOpen, 300, 6, true}),
            "No point of no return: the expert still succeeds from the end, at 6.00 s.");
}

TEST(NoReturn, RefusesWhatItDidNotWrite) {
  const TemporaryFolder folder;
  for (const char* text :
       {"[1]", R"({"x": {}})", R"({"3": {"kind": "maybe", "tick": 1, "time_s": 1, "monotone": true}})",
        R"({"3": {"kind": "lost", "tick": "1"}})"}) {
    std::ofstream(folder.path() / kNoReturnJson) << text;
    try {
      ReadNoReturns(folder.path());
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("no_return.json: expected points by episode")) << text;
    }
  }
}

}  // namespace evalbus::results::no_return_test
