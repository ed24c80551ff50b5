#include "base/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace evalbus::text_test {

TEST(Text, ControlCharactersBecomeQuestionMarks) {
  EXPECT_EQ(Printable("a\x1b[31mb\nc\td\x7f"), "a?[31mb?c?d?");
  EXPECT_EQ(Printable(std::string("a\0b", 3)), "a?b");
  // U+009B is a C1 control character that starts an escape sequence in terminals. U+00E9 is é.
  EXPECT_EQ(Printable("a\xC2\x9B"
                      "31m\xC3\xA9"),
            "a?31m\xC3\xA9");
  // The single byte 0x9B is a control character in Latin-1. In UTF-8 it can be part of another character,
  // here U+5B9B.
  EXPECT_EQ(Printable("a\x9B"
                      "31m"),
            "a?31m");
  EXPECT_EQ(Printable("\xE5\xAE\x9B\x9B"), "\xE5\xAE\x9B?");
  // These texts are invalid UTF-8: truncated, a lone continuation byte, an overlong encoding, a surrogate,
  // and a value above U+10FFFF. A raw 0x9B starts an escape sequence in a terminal that reads Latin-1.
  EXPECT_EQ(Printable("\xC2"), "?");
  EXPECT_EQ(Printable("a\x9Bz"), "a?z");
  EXPECT_EQ(Printable("\xC0\xAF"), "??");
  EXPECT_EQ(Printable("\xE0\x80\xAF"), "???");
  EXPECT_EQ(Printable("\xED\xA0\x80"), "???");
  EXPECT_EQ(Printable("\xF4\x90\x80\x80"), "????");
  // U+FFFF is encoded correctly but is not a character.
  EXPECT_EQ(Printable("\xEF\xBF\xBF!"), "?!");
  EXPECT_EQ(Printable("\xF0\x9F\xA4\x96 m/s³ ✓"), "\xF0\x9F\xA4\x96 m/s³ ✓");
}

TEST(Text, IsMeasuredInCharacters) {
  EXPECT_EQ(Width("é●"), 2);
  EXPECT_EQ(Cut("é●x", 2), "é●");
  EXPECT_EQ(Pad("é", 3), "  é");
  EXPECT_EQ(Pad("é", -3), "é  ");
}

TEST(Number, HasFourDigitsInFiveCharacters) {
  for (const auto& [value, text] : {std::pair(0.0, "0.000"),
                                    {0.00049, "0.000"},
                                    {-0.00049, "0.000"},
                                    {0.0005, "0.001"},
                                    {1.25, "1.250"},
                                    {9.9994, "9.999"},
                                    {9.9995, "10.00"},
                                    {99.995, "100.0"},
                                    {999.95, "1000"},
                                    {12345.0, "12345"},
                                    {99999.4, "99999"},
                                    {99999.5, "100k"},
                                    {123456.0, "123k"},
                                    {-0.004, "-0.004"},
                                    {-0.25, "-0.25"},
                                    {-5.25, "-5.25"},
                                    {-12.25, "-12.2"},
                                    {-123.0, "-123"},
                                    {-1234.0, "-1234"}}) {
    EXPECT_EQ(Number(value), text);
  }
  EXPECT_EQ(Number(std::nan("")), "-");
  EXPECT_EQ(Number(std::numeric_limits<double>::infinity()), "-");
}

TEST(Fixed, WhatRoundsToNothingHasNoSign) {
  EXPECT_EQ(Fixed(-0.3, 0), "0");
  EXPECT_EQ(Fixed(-0.0, 1), "0.0");
  EXPECT_EQ(Fixed(-0.004, 2), "0.00");
  EXPECT_EQ(Fixed(-0.006, 2), "-0.01");
  EXPECT_EQ(Fixed(-1, 0), "-1");
  EXPECT_EQ(Fixed(0.3, 0), "0");
}

TEST(RangesText, ShowsGaps) {
  EXPECT_EQ(RangesText({}), "");
  EXPECT_EQ(RangesText({0}), "0");
  EXPECT_EQ(RangesText({0, 1, 3, 4, 5, 7}), "0, 1, 3 to 5, 7");
  EXPECT_EQ(RangesText({1, 3, 4, 5, 6, 7, 8, 9, 10, 11}), "1, 3 to 11");
}

TEST(Words, HaveSpaces) { EXPECT_EQ(Words("left_gripper_to_pot"), "left gripper to pot"); }

TEST(ShellWords, AreWhatAShellReads) {
  EXPECT_EQ(ShellWords({"/bin/evalbus-sim", "--options", "runs/a/run.json"}),
            "/bin/evalbus-sim --options runs/a/run.json");
  EXPECT_EQ(ShellWords({"sim", "udpm://239.1.2.3:4?ttl=0", "it's", ""}),
            "sim 'udpm://239.1.2.3:4?ttl=0' 'it'\\''s' ''");
}

}  // namespace evalbus::text_test
