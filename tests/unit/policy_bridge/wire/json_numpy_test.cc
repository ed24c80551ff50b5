#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "policy_bridge/wire/codecs.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::json_numpy_test {

using Kind = ServerError::Kind;

TEST(JsonNumpy, WritesAndReadsArraysAsThePackageDoes) {
  const std::vector<std::pair<Array, std::string>> vectors = {
      {{"|u1", {3}, {0, 1, 2}}, R"({"__numpy__":"AAEC","dtype":"|u1","shape":[3]})"},
      {{"<f8", {2}, FromHex("000000000000e03f000000000000f0bf")},
       R"({"__numpy__":"AAAAAAAA4D8AAAAAAADwvw==","dtype":"<f8","shape":[2]})"},
      {{"<f4", {}, FromHex("0000003f")}, R"({"__numpy__":"AAAAPw==","dtype":"<f4","shape":[]})"},
      {{"|u1", {2}, {251, 255}}, R"({"__numpy__":"+/8=","dtype":"|u1","shape":[2]})"},
      {{"<f4", {0, 7}, {}}, R"({"__numpy__":"","dtype":"<f4","shape":[0,7]})"},
  };
  for (const auto& [array, text] : vectors) {
    EXPECT_EQ(EncodeJsonNumpy(array), text);
    EXPECT_EQ(DecodeJsonNumpy(text), Value(array)) << text;
  }
}

TEST(JsonNumpy, KeepsTheOrderOfKeysAndAllKindsOfValues) {
  const Map map = {
      {"z", nullptr}, {"a", true}, {"m", List{1, -2.5, "two \"words\"", Map{}, List{}}}, {"b", 0.1}};
  const std::string text = R"({"z":null,"a":true,"m":[1,-2.5,"two \"words\"",{},[]],"b":0.1})";
  EXPECT_EQ(EncodeJsonNumpy(map), text);
  EXPECT_EQ(DecodeJsonNumpy(text), Value(map));
}

TEST(JsonNumpy, RefusesToWriteWhatJsonHasNoPlaceFor) {
  EXPECT_THROW(EncodeJsonNumpy(NAN), InputError);
  EXPECT_THROW(EncodeJsonNumpy(List{INFINITY}), InputError);
  EXPECT_THROW(EncodeJsonNumpy(Bytes{1}), InputError);
  EXPECT_THROW(EncodeJsonNumpy("\xFF"), InputError);
}

TEST(JsonNumpy, RefusesArraysThatDoNotFit) {
  const auto failure = [](const std::string& text) { return FailureOf([&] { DecodeJsonNumpy(text); }); };
  EXPECT_THAT(
      failure(R"({"__numpy__":"AAEC","dtype":"|u1","shape":[4]})"),
      FailsAs(Kind::kProtocol, "array |u1 [4] has 3 bytes of data, which do not fit its type and shape"));
  EXPECT_THAT(failure(R"({"__numpy__":"AAEC","dtype":"|O","shape":[3]})"), FailsAs(Kind::kProtocol, "|O"));
  EXPECT_THAT(failure(R"({"__numpy__":"AAEC","dtype":"|u1","shape":[-3]})"),
              FailsAs(Kind::kProtocol, "[-3]"));
  EXPECT_THAT(failure(R"({"__numpy__":"AAEC","dtype":"|u1","shape":[3.0]})"),
              FailsAs(Kind::kProtocol, "shape"));
  EXPECT_THAT(failure(R"({"__numpy__":"AAEC","dtype":"|u1"})"), FailsAs(Kind::kProtocol, "shape"));
  EXPECT_THAT(failure(R"({"__numpy__":[0,1],"dtype":"|u1","shape":[2]})"),
              FailsAs(Kind::kProtocol, "__numpy__"));
  for (const char* base64 :
       {"AAE", "AAE=A", "A===", "====", "A=EC", " AEC", "AAEC\\n", "AA-_", "AAEC\\u0000AEC"}) {
    EXPECT_THAT(failure(std::string(R"({"__numpy__":")") + base64 + R"(","dtype":"|u1","shape":[3]})"),
                FailsAs(Kind::kProtocol, "base64"))
        << base64;
  }
}

TEST(JsonNumpy, RefusesWhatIsNoJson) {
  for (const char* text : {"", "{", "[1,", "{\"a\":}", "Internal Server Error", "[1] 2", "NaN", "\"\xFF\"",
                           "[1e999]", "[99999999999999999999]"}) {
    const ServerError error = FailureOf([&] {
      const Value value = DecodeJsonNumpy(text);
      if (std::string(text) == "[99999999999999999999]") {  // JSON reads this number as a float
        throw ServerError(Kind::kProtocol, "JSON: " + Describe(value));
      }
    });
    EXPECT_THAT(error, FailsAs(Kind::kProtocol, "JSON")) << text;
  }
  EXPECT_THAT(FailureOf([] { DecodeJsonNumpy("[9223372036854775808]"); }),
              FailsAs(Kind::kProtocol, "integer"));
}

TEST(JsonNumpy, BoundsDepthAndNumberOfValues) {
  EXPECT_NO_THROW(DecodeJsonNumpy(std::string(32, '[') + std::string(32, ']')));
  EXPECT_THAT(FailureOf([] { DecodeJsonNumpy(std::string(33, '[') + std::string(33, ']')); }),
              FailsAs(Kind::kProtocol, "32 levels"));
  EXPECT_THAT(FailureOf([] { DecodeJsonNumpy(std::string(10'000'000, '[')); }),
              FailsAs(Kind::kProtocol, "levels"));
  std::string many = "[0";
  for (int i = 0; i < 1 << 20; ++i) many += ",0";
  EXPECT_THAT(FailureOf([&] { DecodeJsonNumpy(many + "]"); }), FailsAs(Kind::kProtocol, "a million values"));
}

TEST(JsonNumpy, RefusesAKeyTwice) {
  EXPECT_THAT(FailureOf([] { DecodeJsonNumpy(R"({"a": 1, "b": 2, "a": 1})"); }),
              FailsAs(ServerError::Kind::kProtocol, "key \"a\" twice in a map"));
}

}  // namespace evalbus::policy::json_numpy_test
