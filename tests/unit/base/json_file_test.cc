#include "base/json_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::json_file_test {

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
  EXPECT_EQ(Error(Nested(65)), "file: expected JSON nested at most 64 levels deep");
  std::string objects;
  for (int i = 0; i < 300'000; ++i) objects += "{\"a\":";
  EXPECT_EQ(Error(objects), "file: expected JSON nested at most 64 levels deep");
}

TEST(ParseJson, NamesTheLine) {
  EXPECT_TRUE(Error("{\n\n]").starts_with("file:3: expected JSON, syntax error")) << Error("{\n\n]");
  EXPECT_TRUE(Error("]", 7).starts_with("file:7: expected JSON, syntax error"));
  EXPECT_EQ(Error("{\"a\": 1, \"a\": 2}", 7), "file:7: a: repeated key, expected each key once");
}

TEST(ParseJson, KeepsTheOrderOfKeysIfRequested) {
  const std::string text = R"({"b":1,"a":[{"d":2.5,"c":null}]})";
  EXPECT_EQ(ParseJson<nlohmann::ordered_json>(text, "file").dump(), text);
  EXPECT_EQ(ParseJson(text, "file").dump(), R"({"a":[{"c":null,"d":2.5}],"b":1})");
}

class ReadJsonFileTest : public testing::Test {
 protected:
  // Reads a list and accepts the elements whose "a" is below 100.
  std::string Read(const std::string& elements) {
    const auto file = folder_.path() / "file.json";
    std::ofstream(file) << "{\"list\": [" << elements << "\n],\n\"rest\": 1}";
    taken_ = 0;
    try {
      return ReadJsonFile(file, "list",
                          [&](const nlohmann::json&, const nlohmann::json& element) {
                            if (element.value("a", 100) >= 100) return false;
                            ++taken_;
                            return true;
                          })
          .dump();
    } catch (const InputError& error) {
      return std::string(error.what()).substr(file.string().size());
    }
  }
  TemporaryFolder folder_;
  int taken_ = 0;
};

TEST_F(ReadJsonFileTest, TakenElementsAreNotStored) {
  EXPECT_EQ(Read(R"({"a":1},{"a":2} , {"a":3})"), R"({"list":[],"rest":1})");
  EXPECT_EQ(taken_, 3);
  std::string many = R"({"a":1})";
  for (int k = 0; k < 100'000; ++k) many += ",\n{\"a\": 1}";
  EXPECT_EQ(Read(many), R"({"list":[],"rest":1})");
  EXPECT_EQ(taken_, 100'001);
}

TEST_F(ReadJsonFileTest, AllElementsAfterARefusedOneAreStored) {
  EXPECT_EQ(Read(R"({"a":1},{"a":300},{"a":2},[{"a":3}],4)"),
            R"({"list":[{"a":300},{"a":2},[{"a":3}],4],"rest":1})");
  EXPECT_EQ(taken_, 1);
}

TEST_F(ReadJsonFileTest, AnErrorAfterTakenElementsNamesItsLine) {
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3},\n]"),
            ":4: expected JSON, syntax error while parsing value - unexpected ']'; expected '[', '{', or a "
            "literal");
  EXPECT_EQ(taken_, 3);
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3}\n{\"a\":4}"),
            ":4: expected JSON, syntax error while parsing array - unexpected '{'; expected ']'");
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3},x"),
            ":3: expected JSON, syntax error while parsing value - invalid literal; last read: '3},x'");
  EXPECT_EQ(Read("{\"a\":1},\n{\"a\":2},\n{\"a\":3, \"a\":4}"), ": a: repeated key, expected each key once");
}

}  // namespace evalbus::json_file_test
