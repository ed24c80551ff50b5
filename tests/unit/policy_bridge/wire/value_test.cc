#include "policy_bridge/wire/value.h"

#include <gmock/gmock.h>

#include <cmath>

#include "policy_bridge/wire/policy_client.h"
#include "tests/unit/policy_bridge/wire/hex.h"

namespace evalbus::policy::value_test {

using testing::ElementsAre;

TEST(Value, IsDescribedInALine) {
  EXPECT_EQ(Describe(nullptr), "nothing");
  EXPECT_EQ(Describe(true), "true");
  EXPECT_EQ(Describe(-3), "-3");
  EXPECT_EQ(Describe(0.5), "0.5");
  EXPECT_EQ(Describe("lift\nthe pot"), "text \"lift?the pot\"");
  EXPECT_EQ(Describe(std::string(1000, 'x')), "text \"" + std::string(100, 'x') + "\"");
  EXPECT_EQ(Describe(Bytes{1, 2}), "2 bytes");
  EXPECT_EQ(Describe(Array{"<f4", {10, 16}, {}}), "array <f4 [10, 16]");
  EXPECT_EQ(Describe(List{1, 2}), "list of 2");
  EXPECT_EQ(Describe(Map{{"a", 1}}), "map of 1");
}

TEST(Value, OfAMapIsFoundByItsKey) {
  const Value map = Map{{"a", 1}, {"b", Map{{"c", "text"}}}};
  ASSERT_TRUE(map.Find("b"));
  EXPECT_EQ(*map.Find("b")->Find("c"), Value("text"));
  EXPECT_EQ(map.Find("c"), nullptr);
  EXPECT_EQ(map.Find("a")->Find("b"), nullptr);
}

TEST(ItemSize, IsThatOfNumPysNumbers) {
  for (const auto& [dtype, size] : std::vector<std::pair<const char*, size_t>>{{"|b1", 1},
                                                                               {"|i1", 1},
                                                                               {"|u1", 1},
                                                                               {"<u1", 1},
                                                                               {"<i2", 2},
                                                                               {"<u2", 2},
                                                                               {"<f2", 2},
                                                                               {"<i4", 4},
                                                                               {"<u4", 4},
                                                                               {"<f4", 4},
                                                                               {">f4", 4},
                                                                               {"<i8", 8},
                                                                               {"<u8", 8},
                                                                               {"<f8", 8},
                                                                               {">f8", 8}}) {
    EXPECT_EQ(ItemSize(dtype), size) << dtype;
  }
  for (const char* dtype :
       {"", "f4", "|O", "<c8", "<U4", "<f1", "<b4", "<f3", "<f16", "|f4", "=f4", "|V8", "float32"}) {
    EXPECT_EQ(ItemSize(dtype), 0u) << dtype;
  }
}

TEST(ItemCount, IsTheProductOfTheExtents) {
  EXPECT_EQ(ItemCount({}), 1u);
  EXPECT_EQ(ItemCount({2, 3}), 6u);
  EXPECT_EQ(ItemCount({2, 0, 3}), 0u);
  EXPECT_EQ(ItemCount({-1}), std::nullopt);
  EXPECT_EQ(ItemCount({0, -1}), std::nullopt);
  EXPECT_EQ(ItemCount({int64_t{1} << 31}), size_t{1} << 31);
  EXPECT_EQ(ItemCount({(int64_t{1} << 31) + 1}), std::nullopt);
  EXPECT_EQ(ItemCount({int64_t{1} << 31, int64_t{1} << 31, 4}), std::nullopt);  // 2^64
  EXPECT_EQ(ItemCount({int64_t{1} << 31, int64_t{1} << 31, 4, 0}), 0u);
}

TEST(Numbers, OfEveryTypeAreRead) {
  EXPECT_THAT(Numbers({"|b1", {2}, FromHex("0001")}), ElementsAre(0, 1));
  EXPECT_THAT(Numbers({"|u1", {2}, FromHex("01ff")}), ElementsAre(1, 255));
  EXPECT_THAT(Numbers({"|i1", {2}, FromHex("01ff")}), ElementsAre(1, -1));
  EXPECT_THAT(Numbers({"<i2", {2}, FromHex("0100feff")}), ElementsAre(1, -2));
  EXPECT_THAT(Numbers({"<u2", {1}, FromHex("feff")}), ElementsAre(65534));
  EXPECT_THAT(Numbers({"<i4", {1}, FromHex("feffffff")}), ElementsAre(-2));
  EXPECT_THAT(Numbers({"<u4", {1}, FromHex("feffffff")}), ElementsAre(4294967294.0));
  EXPECT_THAT(Numbers({"<i8", {1}, FromHex("feffffffffffffff")}), ElementsAre(-2));
  EXPECT_THAT(Numbers({"<u8", {1}, FromHex("0000000000000080")}), ElementsAre(9223372036854775808.0));
  EXPECT_THAT(Numbers({"<f4", {1, 2}, FromHex("0000003f000080bf")}), ElementsAre(0.5, -1));
  EXPECT_THAT(Numbers({"<f8", {}, FromHex("000000000000f83f")}), ElementsAre(1.5));
  EXPECT_THAT(Numbers({"<f4", {0, 7}, {}}), ElementsAre());
}

// IEEE 754 binary16 values: 1, -2, the largest (65504), the smallest above zero (2^-24), infinity, and a NaN.
TEST(Numbers, OfHalfPrecisionAreRead) {
  EXPECT_THAT(Numbers({"<f2", {5}, FromHex("003c00c0ff7b0100007c")}),
              ElementsAre(1, -2, 65504, std::ldexp(1.0, -24), INFINITY));
  EXPECT_TRUE(std::isnan(Numbers({"<f2", {1}, FromHex("007e")})[0]));
}

TEST(Numbers, AreNoneOfWhatDoesNotFit) {
  for (const Array& array :
       {Array{"<f4", {2}, Bytes(7)}, Array{"<f4", {2}, Bytes(12)}, Array{"<f4", {-1}, {}},
        Array{"<U4", {1}, Bytes(16)}, Array{">f4", {1}, Bytes(4)}}) {
    try {
      Numbers(array);
      ADD_FAILURE() << Describe(array);
    } catch (const ServerError& error) {
      EXPECT_EQ(error.kind(), ServerError::Kind::kReply);
    }
  }
}

TEST(FloatArray, HasItsNumbersInSinglePrecision) {
  EXPECT_EQ(FloatArray({0.5, -1}, {1, 2}), (Array{"<f4", {1, 2}, FromHex("0000003f000080bf")}));
}

}  // namespace evalbus::policy::value_test
