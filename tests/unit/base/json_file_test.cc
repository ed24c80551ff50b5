#include "base/json_file.h"

#include <gtest/gtest.h>

#include "base/errors.h"

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

}  // namespace
}  // namespace evalbus
