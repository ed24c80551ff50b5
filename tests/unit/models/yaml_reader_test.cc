#include "models/yaml_reader.h"

#include <cmath>
#include <numbers>

#include "tests/unit/models/models_test_util.h"

namespace evalbus::yaml_reader_test {

YamlValue Parse(const std::string& text) { return ParseYaml(text, "f.yaml"); }

// Returns the value under key x of a map.
YamlValue Under(const std::string& text) { return YamlMap(Parse(text), {"x"})["x"]; }

TEST(YamlReader, TypedValues) {
  const YamlMap map(
      Parse("text: two words\nyes: true\nnumber: -1.5e2\nwhole: 7\nvector: [1, 2, 3]\nname: pot_2\n"),
      {"text", "yes", "number", "whole", "vector", "name"}, {"absent"});
  EXPECT_EQ(map["text"].Text(), "two words");
  EXPECT_TRUE(map["yes"].Bool());
  EXPECT_EQ(map["number"].Number(), -150);
  EXPECT_EQ(map["whole"].Integer(0, 7), 7);
  EXPECT_EQ(map["vector"].Vector<3>(), (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(map["name"].Name(), "pot_2");
  EXPECT_EQ(map.Find("absent"), nullptr);
  EXPECT_EQ(map["whole"].location().ToString(), "f.yaml:4");
}

TEST(YamlReader, AssignmentLeavesTheDocumentAlone) {
  const YamlMap map(Parse("a: 1\nb: [2, 3]\n"), {"a", "b"});
  YamlValue value = map["a"];
  value = map["b"];
  EXPECT_EQ(value.Numbers(), (std::vector<double>{2, 3}));
  EXPECT_EQ(value.key(), "b");
  EXPECT_EQ(value.location().line, 2);
  EXPECT_EQ(map["a"].Number(), 1);
  value = YamlValue();
  EXPECT_EQ(map["b"].Numbers().size(), 2u);
}

TEST(YamlReader, UnknownKeyNamesTheNearest) {
  const auto read = [](const char* text) { return [=] { YamlMap(Parse(text), {"time_limit_s", "name"}); }; };
  EXPECT_EQ(ErrorOf(read("name: a\ntime_limt_s: 3\n")),
            "f.yaml:2: key 'time_limt_s': unknown key here; did you mean 'time_limit_s'?");
  EXPECT_EQ(ErrorOf(read("name: a\ncolor: 3\n")),
            "f.yaml:2: key 'color': unknown key here; expected one of name, time_limit_s");
}

TEST(YamlReader, ListsOfNamesAreSortedAndNameEachOnce) {
  EXPECT_EQ(ListOf({"socket/w2", "", "socket/w1", "socket/w2"}), "socket/w1, socket/w2");
  EXPECT_EQ(Suggestion("kettle", {"pot", "lid", "pot"}), "; expected one of lid, pot");
  EXPECT_EQ(Suggestion("kettle", {"", ""}), "");
}

TEST(YamlReader, MissingAndDuplicateKeys) {
  EXPECT_EQ(ErrorOf([] {
              YamlMap(Parse("# c\na: 1\n"), {"a", "b"});
            }),
            "f.yaml:2: key 'b': required here, but missing");
  EXPECT_EQ(ErrorOf([] {
              YamlMap(Under("x:\n  a: 1\n"), {"a", "b"});
            }),
            "f.yaml:1: key 'b': required here, but missing in 'x'");
  EXPECT_EQ(ErrorOf([] {
              YamlMap(Parse("a: 1\nb: 2\na: 3\n"), {"a", "b"});
            }),
            "f.yaml:3: key 'a': given twice, first in line 1");
}

TEST(YamlReader, NumbersOutsideTheirRange) {
  const auto number = [](const std::string& text, NumberRange range) {
    return ErrorOf([&] { Under("x: " + text).Number(range); });
  };
  EXPECT_EQ(number("soon", kPositive), "f.yaml:1: key 'x': expected a number > 0, got 'soon'");
  EXPECT_EQ(number("0", kPositive), "f.yaml:1: key 'x': expected a number > 0, got '0'");
  EXPECT_EQ(number("-1", kNotNegative), "f.yaml:1: key 'x': expected a number >= 0, got '-1'");
  EXPECT_EQ(number("3", {.min = 0, .max = 2}), "f.yaml:1: key 'x': expected a number in [0, 2], got '3'");
  EXPECT_EQ(number("1.5.2", kAnyNumber), "f.yaml:1: key 'x': expected a number, got '1.5.2'");
  EXPECT_EQ(number("[1]", kAnyNumber), "f.yaml:1: key 'x': expected a number, got a list");
  EXPECT_EQ(number("", kAnyNumber), "f.yaml:1: key 'x': expected a number, got nothing");
  EXPECT_EQ(number("'1'", kAnyNumber), "f.yaml:1: key 'x': expected a number, got '1'");
}

TEST(YamlReader, OnlyFiniteNumbers) {
  for (const char* text : {".nan", ".inf", "-.inf", "nan", "inf", "-inf", "1e999"}) {
    EXPECT_EQ(ErrorOf([&] { Under(std::string("x: ") + text).Number(); }),
              std::string("f.yaml:1: key 'x': expected a number, got '") + text + "'");
  }
}

TEST(YamlReader, OtherTypes) {
  EXPECT_EQ(ErrorOf([] { Under("x: 1.5").Integer(0); }),
            "f.yaml:1: key 'x': expected a whole number >= 0, got '1.5'");
  EXPECT_EQ(ErrorOf([] { Under("x: 9").Integer(1, 3); }),
            "f.yaml:1: key 'x': expected a whole number from 1 to 3, got '9'");
  EXPECT_EQ(ErrorOf([] { Under("x: yes").Bool(); }), "f.yaml:1: key 'x': expected true or false, got 'yes'");
  EXPECT_EQ(ErrorOf([] { Under("x: a/b").Name(); }),
            "f.yaml:1: key 'x': expected a name of letters, digits and underscores, got 'a/b'");
  EXPECT_EQ(Under("x: 1").KeyName(), "x");
  EXPECT_EQ(ErrorOf([] { Under("x:\n  a b: 1").Entries()[0].KeyName(); }),
            "f.yaml:2: key 'a b': this key must be a name of letters, digits and underscores");
  EXPECT_EQ(ErrorOf([] { Under("x:\n  a: 1").Text(); }), "f.yaml:1: key 'x': expected text, got a map");
  EXPECT_EQ(ErrorOf([] { Under("x: [1, 2]").Vector<3>(); }),
            "f.yaml:1: key 'x': expected a list of 3 numbers, got 2");
  EXPECT_EQ(ErrorOf([] { Under("x:\n  - 1\n  - b\n").Vector<2>(); }),
            "f.yaml:3: key 'x[1]': expected a number, got 'b'");
  EXPECT_EQ(ErrorOf([] { Under("x: 3").List(); }), "f.yaml:1: key 'x': expected a list, got '3'");
  EXPECT_EQ(ErrorOf([] { YamlMap(Under("x: 3"), {}); }), "f.yaml:1: key 'x': expected a map, got '3'");
}

TEST(YamlReader, AnchorsAliasesAndMerging) {
  const YamlMap root(Parse("a: &a {p: 1, q: 2}\nb: {<<: *a, q: 3}\nc: *a\n"), {"a", "b", "c"});
  const YamlMap b(root["b"], {"p", "q"});
  EXPECT_EQ(b["p"].Number(), 1);
  EXPECT_EQ(b["q"].Number(), 3);
  EXPECT_EQ(YamlMap(root["c"], {"p", "q"})["q"].Number(), 2);
}

TEST(YamlReader, EndlessAndHugeDocumentsAreRefused) {
  EXPECT_EQ(ErrorOf([] { Parse("a: &a [1, *a]\n"); }), "f.yaml:1: too deeply nested or too long");
  std::string bomb = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (char name = 'b'; name < 'k'; ++name) {
    bomb += std::string(1, name) + ": &" + name + " [";
    for (int k = 0; k < 10; ++k) bomb += std::string("*") + static_cast<char>(name - 1) + ",";
    bomb += "]\n";
  }
  EXPECT_NE(ErrorOf([&] { Parse(bomb); }).find("too deeply nested or too long"), std::string::npos);
}

TEST(YamlReader, BrokenYaml) {
  EXPECT_EQ(ErrorOf([] { Parse("a: [1, 2\nb: 3\n"); }).substr(0, 9), "f.yaml:2:");
  EXPECT_EQ(ErrorOf([] { Parse(""); }), "f.yaml:1: expected one YAML document, got 0");
  EXPECT_EQ(ErrorOf([] { Parse("a: 1\n---\nb: 2\n"); }), "f.yaml:1: expected one YAML document, got 2");
  // yaml-cpp makes an endless number of documents from this text.
  EXPECT_EQ(ErrorOf([] { Parse(", 1]}\n"); }), "f.yaml:1: expected one YAML document, got 2");
}

// LCM's strings end at the first NUL, so the text after it would be lost.
TEST(YamlReader, TextThatNoMessageCanCarryIsRefusedWithItsLine) {
  using namespace std::string_literals;
  EXPECT_EQ(ErrorOf([] {
              Parse(
                  "\xFF\xFE"
                  "a\0:\0 \0001\0\n\0"s);
            }),
            "f.yaml:1: this is UTF-16; expected UTF-8 (iconv -f UTF-16 -t UTF-8)");
  EXPECT_EQ(ErrorOf([] { Parse("\xFE\xFF\0a\0:\0 \0001"s); }),
            "f.yaml:1: this is UTF-16; expected UTF-8 (iconv -f UTF-16 -t UTF-8)");
  EXPECT_EQ(ErrorOf([] { Parse("a\0:\0 \0001\0"s); }), "f.yaml:1: a NUL byte; expected text in UTF-8");
  EXPECT_EQ(ErrorOf([] { Parse("a: 1\nb: 2  # a comment\0\n"s); }),
            "f.yaml:2: a NUL byte; expected text in UTF-8");
  EXPECT_EQ(ErrorOf([] { Parse("a: 1\nb: [2, \"x\\0y\"]\n"); }),
            "f.yaml:2: the text contains a control character");
  EXPECT_EQ(ErrorOf([] { Parse("a: 1\n\"x\\0y\": 2\n"); }),
            "f.yaml:2: the text contains a control character");
  EXPECT_EQ(ErrorOf([] { Parse("a: \"red \\e[31m\"\n"); }),
            "f.yaml:1: the text contains a control character");
}

TEST(YamlReader, TagsAreRefused) {
  EXPECT_EQ(Parse("a: [1, 'two', {b: \"3\"}]\n").Entries().size(), 1u);
  EXPECT_EQ(ErrorOf([] { Parse("a: 1\nb: !!str 20\n"); }), "f.yaml:2: a tag such as !!str is not supported");
  EXPECT_EQ(ErrorOf([] { Parse("a: !mine [1]\n"); }), "f.yaml:1: a tag such as !!str is not supported");
}

TEST(YamlReader, Angles) {
  const auto angle = [](const char* text) { return YamlMap(Parse(text), {}, {"x_deg", "x_rad"}).Angle("x"); };
  EXPECT_EQ(angle("x_deg: 180"), std::numbers::pi);
  EXPECT_EQ(angle("x_rad: 1"), 1);
  EXPECT_EQ(angle("{}"), std::nullopt);
  EXPECT_EQ(ErrorOf([&] { angle("x_deg: 1\nx_rad: 1"); }),
            "f.yaml:2: key 'x_rad': give either this or 'x_deg'");
}

TEST(YamlReader, Poses) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ReadPose(Parse(text)); }); };
  EXPECT_NE(error("{position_m: [700, 0, 996]}").find("expected a number in [-10, 10], got '700'"),
            std::string::npos);
  EXPECT_NE(error("{position_m: [1, 2, 3], yaw_rad: -90}").find("key 'yaw_rad': expected a number in [-6.28"),
            std::string::npos);
  const Pose turned = ReadPose(Parse("{position_m: [1, 2, 3], yaw_deg: 90}"));
  EXPECT_EQ(turned.position, (std::array<double, 3>{1, 2, 3}));
  EXPECT_NEAR(turned.quaternion[0], std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(turned.quaternion[3], std::sqrt(0.5), 1e-15);
  const Pose upright = ReadPose(Parse("{position_m: [0, 0, 0], quaternion_wxyz: [0.7071, 0.7071, 0, 0]}"));
  EXPECT_NEAR(upright.quaternion[1], std::sqrt(0.5), 1e-15);
  EXPECT_EQ(ErrorOf([] { ReadPose(Parse("{position_m: [0, 0, 0], quaternion_wxyz: [1, 1, 0, 0]}")); }),
            "f.yaml:1: key 'quaternion_wxyz': expected a unit quaternion, got norm 1.41421; of norm 1 "
            "it is [0.707107, 0.707107, 0, 0]");
  EXPECT_EQ(ErrorOf([] { ReadPose(Parse("{position: [0, 0, 0]}")); }),
            "f.yaml:1: key 'position': unknown key here; did you mean 'position_m'?");
}

}  // namespace evalbus::yaml_reader_test
