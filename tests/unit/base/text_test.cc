#include "base/text.h"

#include <gtest/gtest.h>

namespace evalbus {
namespace {

TEST(Text, ControlCharactersBecomeQuestionMarks) {
  EXPECT_EQ(Printable("a\x1b[31mb\nc\td\x7f"), "a?[31mb?c?d?");
  EXPECT_EQ(Printable(std::string("a\0b", 3)), "a?b");
  // U+009B is a terminal's other way to begin an escape sequence; U+00E9 is é.
  EXPECT_EQ(Printable("a\xC2\x9B"
                      "31m\xC3\xA9"),
            "a?31m\xC3\xA9");
  EXPECT_EQ(Printable("\xC2"), "\xC2");
}

TEST(Text, IsMeasuredInCharacters) {
  EXPECT_EQ(Width("é●"), 2);
  EXPECT_EQ(Cut("é●x", 2), "é●");
  EXPECT_EQ(Pad("é", 3), "  é");
  EXPECT_EQ(Pad("é", -3), "é  ");
}

}  // namespace
}  // namespace evalbus
