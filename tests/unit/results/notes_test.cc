// Tests users' notes in notes.json of a run folder.
#include "results/notes.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::notes_test {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Optional;
using testing::Pair;

class NotesTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(run_ / kEpisodesFolder); }
  std::string Refusal(int episode, const std::string& text) const {
    try {
      WriteNote(run_, episode, text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string Content() const {
    std::ifstream file(run_ / kNotesJson);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  TemporaryFolder folder_;
  const fs::path run_ = folder_.path();
};

TEST_F(NotesTest, AreReadAsWritten) {
  EXPECT_THAT(ReadNotes(run_), IsEmpty());
  WriteNote(run_, 12, "pot \"tilts\" µ");
  WriteNote(run_, 3, "first");
  WriteNote(run_, 12, "other");
  EXPECT_THAT(ReadNotes(run_), ElementsAre(Pair(3, "first"), Pair(12, "other")));
  EXPECT_EQ(Content(), "{\n  \"3\": \"first\",\n  \"12\": \"other\"\n}\n");
  WriteNote(run_, 3, "");
  EXPECT_THAT(ReadNotes(run_), ElementsAre(Pair(12, "other")));
}

TEST_F(NotesTest, AFileThatIsNotOfNotesIsRefusedAndKept) {
  for (const char* text : {"[]", "{\"x\": \"a\"}", "{\"1\": 2}", "{\"-1\": \"a\"}", "{\"1"}) {
    WriteFile(run_ / kNotesJson, text);
    EXPECT_THROW(ReadNotes(run_), InputError) << text;
    EXPECT_THAT(Refusal(1, "a"), HasSubstr("notes.json")) << text;
    EXPECT_EQ(Content(), text);
  }
}

TEST_F(NotesTest, NothingIsWrittenThroughALinkOrIntoAPipe) {
  fs::create_symlink(folder_.path() / "elsewhere", run_ / kNotesJson);
  EXPECT_THAT(Refusal(1, "a"), HasSubstr("a link"));
  EXPECT_FALSE(fs::exists(folder_.path() / "elsewhere"));
  fs::remove(run_ / kNotesJson);
  ASSERT_EQ(mkfifo((run_ / kNotesJson).c_str(), 0600), 0);
  EXPECT_THAT(Refusal(1, "a"), HasSubstr("notes.json"));
  EXPECT_TRUE(fs::is_fifo(run_ / kNotesJson));
}

TEST_F(NotesTest, TooLongANoteIsRefused) {
  EXPECT_EQ(Refusal(0, std::string(kMaxNoteBytes, 'x')), "");
  EXPECT_THAT(Refusal(1, std::string(kMaxNoteBytes + 1, 'x')), HasSubstr("at most 2000 bytes"));
  EXPECT_EQ(ReadNotes(run_).size(), 1u);
}

TEST_F(NotesTest, AFollowerReturnsEachChangeOnce) {
  NotesFollower follower(run_);
  EXPECT_THAT(follower.Update(), Optional(IsEmpty()));
  EXPECT_EQ(follower.Update(), std::nullopt);
  WriteNote(run_, 4, "a");
  EXPECT_THAT(follower.Update(), Optional(ElementsAre(Pair(4, "a"))));
  EXPECT_EQ(follower.Update(), std::nullopt);
  fs::remove(run_ / kNotesJson);
  EXPECT_THAT(follower.Update(), Optional(IsEmpty()));
  WriteFile(run_ / kNotesJson, "[]");
  EXPECT_THROW(follower.Update(), InputError);
  EXPECT_EQ(follower.Update(), std::nullopt);
}

}  // namespace evalbus::results::notes_test
