#include "base/json_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <fstream>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/json_text.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {
namespace {

std::string Error(const std::string& text, int line = 0) {
  try {
    ParseJson(text, "file", line);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string Nested(size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); }

TEST(ParseJson, IsBoundedInDepth) {
  EXPECT_EQ(Error(Nested(64)), "accepted");
  EXPECT_EQ(Error(Nested(65)), "file: expected JSON nested 64 deep at most");
  std::string objects;
  for (int i = 0; i < 300'000; ++i) objects += "{\"a\":";
  EXPECT_EQ(Error(objects), "file: expected JSON nested 64 deep at most");
}

TEST(ParseJson, NamesTheLine) {
  EXPECT_TRUE(Error("{\n\n]").starts_with("file:3: expected JSON, syntax error")) << Error("{\n\n]");
  EXPECT_TRUE(Error("]", 7).starts_with("file:7: expected JSON, syntax error"));
  EXPECT_EQ(Error("{\"a\": 1, \"a\": 2}", 7), "file:7: a: expected each key once, it is repeated");
}

TEST(ParseJson, KeepsTheOrderOfKeysWhereAskedTo) {
  const std::string text = R"({"b":1,"a":[{"d":2.5,"c":null}]})";
  EXPECT_EQ(ParseJson<nlohmann::ordered_json>(text, "file").dump(), text);
  EXPECT_EQ(ParseJson(text, "file").dump(), R"({"a":[{"c":null,"d":2.5}],"b":1})");
}

// Elements {"a":N} taken as text, where N is below 100.
class ReadJsonFileTest : public testing::Test {
 protected:
  std::string Read(const std::string& elements) {
    const auto file = folder_.path() / "file.json";
    std::ofstream(file) << "{\"list\": [" << elements << "\n],\n\"rest\": 1}";
    parsed_ = text_ = 0;
    try {
      return ReadJsonFile(
                 file, "list",
                 [&](const nlohmann::json&, const nlohmann::json&) {
                   ++parsed_;
                   return true;
                 },
                 [&](std::string_view text) -> size_t {
                   static const std::vector<std::string> keys = {"\"a\""};
                   double value = 0;
                   JsonText in(text);
                   if (!in.TakeObject(keys, [&](size_t) { return in.TakeNumber(&value); })) return 0;
                   if (value >= 100) return 0;
                   ++text_;
                   return text.size() - in.rest().size();
                 })
          .dump();
    } catch (const InputError& error) {
      return std::string(error.what()).substr(file.string().size());
    }
  }
  TemporaryFolder folder_;
  int parsed_ = 0, text_ = 0;
};

TEST_F(ReadJsonFileTest, EachElementIsTakenOnce) {
  EXPECT_EQ(Read(R"({"a":1})"), R"({"list":[],"rest":1})");
  EXPECT_EQ(parsed_, 1);
  EXPECT_EQ(Read(R"({"a":1},{"a":2} , {"a":300},{"a":4},{"a":5},{"b":6},{"a":7})"),
            R"({"list":[],"rest":1})");
  EXPECT_EQ(parsed_, 3);
  EXPECT_EQ(text_, 4);
  std::string many = R"({"a":1})";
  for (int k = 0; k < 100'000; ++k) many += ",\n{\"a\": 1}";
  EXPECT_EQ(Read(many), R"({"list":[],"rest":1})");
  EXPECT_EQ(text_ + parsed_, 100'001);
  // Those at the end of what was looked at are the library's.
  EXPECT_LT(parsed_, 20);
}

// As without: the library's words include what it read before.
TEST_F(ReadJsonFileTest, AMistakeBehindTextsIsWhereItIs) {
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3},\n]"),
            ":4: expected JSON, syntax error while parsing value - unexpected ']'; expected '[', '{', or a "
            "literal");
  EXPECT_EQ(text_, 2);
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3}\n{\"a\":4}"),
            ":4: expected JSON, syntax error while parsing array - unexpected '{'; expected ']'");
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3},x"),
            ":3: expected JSON, syntax error while parsing value - invalid literal; last read: '3},x'");
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3, \"a\":4}"),
            ": a: expected each key once, it is repeated");
}

// What it takes is what the library makes of it, to the bit; what is no JSON it leaves.
TEST(JsonText, TakesNumbersAsTheLibraryDoes) {
  const char* numbers[] = {"0",
                           "-0",
                           "-0.0",
                           "1",
                           "-12",
                           "0.1",
                           "1e22",
                           "1E-7",
                           "2.5e+3",
                           "1e23",
                           "0e5",
                           "9007199254740993",
                           "4.9e-324",
                           "1.7976931348623157e308",
                           "2.2250738585072011e-308",
                           "18446744073709551615",
                           "18446744073709551616",
                           "-9223372036854775809",
                           "0.1000000000000000055511151231257827021181583404541015625"};
  for (const std::string number : numbers) {
    const std::string text = " " + number + ",";
    JsonText in(text);
    double value = 0;
    bool whole = false;
    ASSERT_TRUE(in.TakeNumber(&value, &whole)) << number;
    EXPECT_EQ(in.rest(), ",");
    const auto expected = nlohmann::json::parse(number);
    EXPECT_EQ(std::bit_cast<uint64_t>(value), std::bit_cast<uint64_t>(expected.get<double>())) << number;
    EXPECT_EQ(whole, number.find_first_of(".eE") == std::string::npos) << number;
  }
  for (const char* text :
       {"",     "-,",    "+1,",    ".5,",     "5.,",    "5.e3,", "01,", "-01,", "inf,", "nan,",
        "NaN,", "-inf,", "1e999,", "-1e999,", "\"1\",", "null,", "1",   "1.5",  "1.",   "1e5"}) {
    JsonText in(text);
    double value = 0;
    EXPECT_FALSE(in.TakeNumber(&value)) << text;
  }
  // What follows is for the next token to refuse.
  for (const char* text : {"1e,", "1e+,", "0x10,", "1_0,", "1.5.5,"}) {
    JsonText in(text);
    double value = 0;
    EXPECT_FALSE(in.TakeNumber(&value) && in.Take(',')) << text;
  }
}

TEST(JsonText, TakesAnObjectOfItsKeysInAnyOrder) {
  const std::vector<std::string> keys = {"\"a\"", "\"b\""};
  const auto taken = [&](const char* text) {
    JsonText in(text);
    std::vector<double> values(2);
    const bool all = in.TakeObject(keys, [&](size_t key) { return in.TakeNumber(&values[key]); });
    if (all) {
      EXPECT_EQ(values, (std::vector<double>{1, 2}));
    }
    return all;
  };
  EXPECT_TRUE(taken("{\"a\":1,\"b\":2}"));
  EXPECT_TRUE(taken(" {\n\"b\" : 2 , \"a\"\t:\r1 } "));
  for (const char* text :
       {"", "{}", "{\"a\":1}", "{\"a\":1,\"a\":1}", "{\"a\":1,\"b\":2,\"b\":2}", "{\"a\":1,\"b\":2,}",
        "{\"a\":1,\"b\":2,\"c\":3}", "{\"a\":1,\"b\":2", "{\"a\":1 \"b\":2}", "{\"a\" 1,\"b\":2}",
        "{a:1,\"b\":2}", "{\"\\u0061\":1,\"b\":2}", "[1,2]"}) {
    EXPECT_FALSE(taken(text)) << text;
  }
}

}  // namespace
}  // namespace evalbus
