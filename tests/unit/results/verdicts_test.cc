// Tests operators' verdicts in verdicts.jsonl of a run folder.
#include "results/verdicts.h"

#include <gmock/gmock.h>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::verdicts_test {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Optional;

constexpr char kLine[] =
    R"({"episode":3,"operator":"ann","verdict":"success","stages_reached":2,"rubric":7.5,"time_utc":"t","place":5,"order_seed":11})"
    "\n";

class VerdictsTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(run_ / kEpisodesFolder); }
  std::string Content() const {
    std::ifstream file(run_ / kVerdictsJsonl);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // Returns the error of adding a verdict to a file with this content. The file must not change.
  std::string Refusal(const std::string& text) {
    WriteFile(run_ / kVerdictsJsonl, text);
    try {
      WriteVerdict(run_, {.episode = 1, .operator_name = "ann"});
    } catch (const InputError& error) {
      EXPECT_EQ(Content(), text);
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder_;
  const fs::path run_ = folder_.path();
};

TEST_F(VerdictsTest, AreReadAsWritten) {
  EXPECT_THAT(ReadVerdicts(run_), IsEmpty());
  WriteVerdict(run_, {.episode = 3,
                      .operator_name = "ann",
                      .outcome = Outcome::kSuccess,
                      .stages = 2,
                      .rubric = 7.5,
                      .time = "t",
                      .place = 5,
                      .order_seed = 11});
  EXPECT_EQ(Content(), kLine);
  WriteVerdict(run_, {.episode = 3, .operator_name = "bob", .outcome = Outcome::kAbstain, .time = "u"});
  const std::vector<Verdict> verdicts = ReadVerdicts(run_);
  ASSERT_EQ(verdicts.size(), 2u);
  EXPECT_EQ(verdicts[0].operator_name, "ann");
  EXPECT_EQ(verdicts[0].outcome, Outcome::kSuccess);
  EXPECT_THAT(verdicts[0].stages, Optional(2));
  EXPECT_THAT(verdicts[0].rubric, Optional(7.5));
  EXPECT_EQ(verdicts[0].place, 5);
  EXPECT_THAT(verdicts[0].order_seed, Optional(11));
  EXPECT_EQ(verdicts[1].outcome, Outcome::kAbstain);
  EXPECT_EQ(verdicts[1].stages, std::nullopt);
  EXPECT_EQ(verdicts[1].order_seed, std::nullopt);
}

TEST_F(VerdictsTest, NameTheOtherRunOfAPair) {
  const std::string other(64, 'a');
  WriteVerdict(run_,
               {.episode = 3, .operator_name = "ann", .time = "t", .order_seed = 11, .other_run = other});
  EXPECT_THAT(Content(), HasSubstr(R"("order_seed":11,"other_run":")" + other + "\"}"));
  EXPECT_EQ(ReadVerdicts(run_)[0].other_run, other);
  EXPECT_THAT(Refusal(R"({"episode":3,"operator":"ann","verdict":"success","stages_reached":2,"rubric":7.5,)"
                      R"("time_utc":"t","place":5,"order_seed":11,"other_run":"b"})"
                      "\n"),
              HasSubstr("1: \"other_run\": expected a SHA-256"));
}

TEST_F(VerdictsTest, AnotherVerdictOfTheSameOperatorReplacesTheFirst) {
  for (const Outcome outcome : {Outcome::kSuccess, Outcome::kFailure}) {
    WriteVerdict(run_, {.episode = 3, .operator_name = "ann", .outcome = outcome});
    WriteVerdict(run_, {.episode = 4, .operator_name = "ann", .outcome = outcome});
  }
  const std::vector<Verdict> verdicts = ReadVerdicts(run_);
  ASSERT_EQ(verdicts.size(), 2u);
  EXPECT_EQ(verdicts[0].outcome, Outcome::kFailure);
  EXPECT_EQ(verdicts[0].episode, 3);
}

TEST_F(VerdictsTest, AFileThatIsNotOfVerdictsIsRefusedWithItsLineAndKept) {
  const std::string line = kLine;
  const auto changed = [&](const std::string& from, const std::string& to) {
    return line + std::string(line).replace(line.find(from), from.size(), to);
  };
  EXPECT_THAT(Refusal("[]\n"), HasSubstr("verdicts.jsonl:1: expected a JSON object"));
  EXPECT_THAT(Refusal(line + "{\"episode\""), HasSubstr("verdicts.jsonl:2"));
  EXPECT_THAT(Refusal(line + line), HasSubstr("verdicts.jsonl:2: a second verdict of ann on episode 3"));
  EXPECT_THAT(Refusal(changed("3", "-3")), HasSubstr("2: \"episode\": expected the number of an episode"));
  EXPECT_THAT(Refusal(changed("success", "good")), HasSubstr("2: \"verdict\": expected \"success\""));
  EXPECT_THAT(Refusal(changed("7.5", "10.5")), HasSubstr("2: \"rubric\": expected a number from 0 to 10"));
  EXPECT_THAT(Refusal(changed("\"place\"", "\"at\"")), HasSubstr("2: \"place\": expected a number from 0"));
  EXPECT_THAT(Refusal(changed("ann", "a\\nb")), HasSubstr("2: \"operator\": expected a name of 1 to 100"));
  EXPECT_THAT(Refusal(changed("11", "9223372036854775808")),
              HasSubstr("2: \"order_seed\": expected an integer"));
  EXPECT_THAT(Refusal(changed("11", "11,\"mood\":1")), HasSubstr("2: unknown key \"mood\""));
}

TEST_F(VerdictsTest, NothingIsWrittenThroughALink) {
  fs::create_symlink(folder_.path() / "elsewhere", run_ / kVerdictsJsonl);
  EXPECT_THROW(WriteVerdict(run_, {.operator_name = "ann"}), InputError);
  EXPECT_FALSE(fs::exists(folder_.path() / "elsewhere"));
}

TEST(OperatorName, IsOneShortLine) {
  EXPECT_NO_THROW(CheckOperatorName("Ann B. 2"));
  for (const std::string& name : {std::string(), std::string("a\nb"), std::string(101, 'a')})
    EXPECT_THROW(CheckOperatorName(name), InputError) << name;
}

}  // namespace evalbus::results::verdicts_test
