#include "base/safetensors.h"

#include <gmock/gmock.h>

#include "base/errors.h"
#include "base/legacy_random.h"

namespace evalbus::safetensors_test {

std::string File(const std::string& header, const std::string& data) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(header.size() >> (8 * i) & 0xff);
  return bytes + header + data;
}

Safetensors Parse(const std::string& bytes) {
  return ParseSafetensors({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, "a.safetensors");
}

TEST(Safetensors, AreReadAsWritten) {
  Safetensors content;
  content.tensors = {{"b", DoubleTensor({1.5, -2}, {2, 1})}, {"a", ByteTensor({1, 0, 1}, {3}, "BOOL")}};
  content.metadata = {{"seed", "7"}};
  const Safetensors read = Parse(EncodeSafetensors(content));
  EXPECT_EQ(read.metadata, content.metadata);
  EXPECT_EQ(read.Find("b")->Numbers(), (std::vector<double>{1.5, -2}));
  EXPECT_EQ(read.Find("b")->shape, (std::vector<int64_t>{2, 1}));
  EXPECT_EQ(read.Find("a")->Numbers(), (std::vector<double>{1, 0, 1}));
  EXPECT_EQ(read.Find("c"), nullptr);
}

TEST(Safetensors, WhatIsWrongIsOneLine) {
  const std::string one = R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]}})";
  EXPECT_EQ(Parse(File(one, "xy")).Find("a")->data.size(), 2u);
  const struct {
    std::string bytes, message;
  } kCases[] = {
      {"abc", "shorter than the 8 bytes"},
      {std::string("\x00\xe4\x0b\x54\x02\x00\x00\x00{}", 10), "header would be 10000000000 bytes long"},
      {std::string("\xff\xff\xff\xff\xff\xff\xff\xff", 8), "18446744073709551615 bytes long"},
      {File(one, "xy").substr(0, 20), "truncated: the header is 53 bytes long, the file has 12"},
      {File(one, "x"), "lies at bytes 0 to 2 of 1: the file is truncated"},
      {File(one, "xyz"), "1 byte after the last tensor, expected none"},
      {File("[1]", ""), "expected a JSON object"},
      {File("{", ""), "a.safetensors"},
      {File(R"({"a":{"dtype":"U8","shape":[2]}})", "xy"), "expected {dtype, shape"},
      {File(R"({"a":{"dtype":"U8","shape":[-2],"data_offsets":[0,2]}})", "xy"), "expected {dtype, shape"},
      {File(R"({"a":{"dtype":"Q8","shape":[2],"data_offsets":[0,2]}})", "xy"), "unknown dtype Q8"},
      {File(R"({"a":{"dtype":"F64","shape":[2],"data_offsets":[0,2]}})", "xy"), "do not match"},
      {File(R"({"a":{"dtype":"U8","shape":[1099511627776,1099511627776],"data_offsets":[0,0]}})", ""),
       "do not match"},
      {File(
           R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]},"b":{"dtype":"U8","shape":[2],"data_offsets":[1,3]}})",
           "xyz"),
       "overlaps"},
      {File(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[1,3]}})", "xyz"), "belong to no tensor"},
      {File(R"({"__metadata__":{"a":1}})", ""), "is not text"},
  };
  for (const auto& [bytes, message] : kCases) {
    try {
      Parse(bytes);
      ADD_FAILURE() << message;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(message));
      EXPECT_THAT(error.what(), testing::StartsWith("a.safetensors"));
      EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
    }
  }
}

// NumPy computed these values. tests/python/legacy_random_test.py has the full comparison.
TEST(LegacyRandom, IsNumPys) {
  EXPECT_EQ(LegacyRandom(0).Double(), 0.5488135039273248);
  EXPECT_EQ(LegacyRandom(42).Double(), 0.3745401188473625);
  EXPECT_EQ(LegacyRandom(0).Permutation(10), (std::vector<int>{2, 8, 4, 9, 1, 6, 7, 3, 0, 5}));
  EXPECT_EQ(LegacyRandom(42).Permutation(10), (std::vector<int>{8, 1, 5, 0, 7, 2, 9, 4, 3, 6}));
  EXPECT_EQ(LegacyRandom(7).Permutation(1), (std::vector<int>{0}));
}

}  // namespace evalbus::safetensors_test
