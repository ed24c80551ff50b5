#include <gmock/gmock.h>

#include <limits>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/policy_bridge/wire/hex.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::msgpack_codec_test {

using testing::HasSubstr;

// The vectors of the specification come from an independent encoder.
struct MsgpackVector {
  const char* hex;
  ArrayKeys array_keys;
  Value value;
};

const Array kBytes012{"|u1", {3}, {0, 1, 2}};
const Array kHalfAndMinusOne{"<f4", {2}, FromHex("0000003f000080bf")};

const std::vector<MsgpackVector> kVectors = {
    {"80", ArrayKeys::kBytes, Map{}},
    {"81a16184c40b5f5f6e6461727261795f5fc3c40464617461c403000102c4056474797065a37c7531c40573686170659103",
     ArrayKeys::kBytes, Map{{"a", kBytes012}}},
    {"82a7616374696f6e7384c40b5f5f6e6461727261795f5fc3c40464617461c4080000003f000080bfc4056474797065a33c6634c"
     "4057368"
     "617065920102ad7365727665725f74696d696e6781a8696e6665725f6d73cb3ff8000000000000",
     ArrayKeys::kBytes,
     Map{{"actions", FloatArray({0.5, -1}, {1, 2})}, {"server_timing", Map{{"infer_ms", 1.5}}}}},
    {"84a474797065a568656c6c6fa77061796c6f616482af6861726e6573735f76657273696f6ea76576616c627573b070726f746f6"
     "36f6c5f"
     "76657273696f6e01a373657100a974696d657374616d70cb0000000000000000",
     ArrayKeys::kTexts,
     Map{{"type", "hello"},
         {"payload", Map{{"harness_version", "evalbus"}, {"protocol_version", 1}}},
         {"seq", 0},
         {"timestamp", 0.0}}},
    {"84a474797065ab6f62736572766174696f6ea77061796c6f616483a6696d6167657381a46865616484ab5f5f6e6461727261795"
     "f5fc3a4"
     "64617461c403010203a56474797065a37c7531a5736861706593010103a673746174657384ab5f5f6e6461727261795f5fc3a46"
     "4617461"
     "c4080000003f000080bfa56474797065a33c6634a573686170659102b07461736b5f6465736372697074696f6ea46c696674a37"
     "3657102"
     "a974696d657374616d70cb0000000000000000",
     ArrayKeys::kTexts,
     Map{{"type", "observation"},
         {"payload", Map{{"images", Map{{"head", Array{"|u1", {1, 1, 3}, {1, 2, 3}}}}},
                         {"states", kHalfAndMinusOne},
                         {"task_description", "lift"}}},
         {"seq", 2},
         {"timestamp", 0.0}}},
    {"84a474797065a6616374696f6ea77061796c6f616481a7616374696f6e7384ab5f5f6e6461727261795f5fc3a464617461c4080"
     "000003f"
     "000080bfa56474797065a33c6634a573686170659102a373657102a974696d657374616d70cb0000000000000000",
     ArrayKeys::kTexts,
     Map{{"type", "action"},
         {"payload", Map{{"actions", kHalfAndMinusOne}}},
         {"seq", 2},
         {"timestamp", 0.0}}},
    // Python's msgpack with msgpack-numpy wrote this message.
    {"81a16185c4026e64c3c40474797065a37c7531c4046b696e64c400c40573686170659103c40464617461c403000102",
     ArrayKeys::kMsgpackNumpy, Map{{"a", kBytes012}}},
    {"85c4026e64c3c40474797065a33c6634c4046b696e64c400c4057368617065920102c40464617461c4080000003f000080bf",
     ArrayKeys::kMsgpackNumpy, FloatArray({0.5, -1}, {1, 2})},
    {"85c4026e64c3c40474797065a33c6638c4046b696e64c400c405736861706590c40464617461c408000000000000f83f",
     ArrayKeys::kMsgpackNumpy, Array{"<f8", {}, FromHex("000000000000f83f")}},
};

TEST(MsgpackCodec, WritesTheVectorsOfTheSpecification) {
  for (const MsgpackVector& vector : kVectors)
    EXPECT_EQ(ToHex(EncodeMsgpack(vector.value, vector.array_keys)), vector.hex);
}

TEST(MsgpackCodec, ReadsTheVectorsOfTheSpecification) {
  for (const MsgpackVector& vector : kVectors)
    EXPECT_EQ(DecodeMsgpack(FromHex(vector.hex)), vector.value) << vector.hex;
}

Value RoundTrip(const Value& value) { return DecodeMsgpack(EncodeMsgpack(value, ArrayKeys::kBytes)); }

TEST(MsgpackCodec, KeepsEveryValue) {
  constexpr int64_t kLeast = std::numeric_limits<int64_t>::min(), kMax = std::numeric_limits<int64_t>::max();
  for (const Value& value :
       {Value(nullptr), Value(false), Value(-1), Value(kLeast), Value(kMax), Value(1.0), Value(-1e300),
        Value(""), Value(std::string(70000, 'x')), Value(Bytes(300, 7)), Value(List{1, "a", List{}}),
        Value(Map{{"z", 1}, {"a", nullptr}}), Value(Array{"<f8", {}, FromHex("000000000000f83f")}),
        Value(Array{"<i8", {0, 3}, {}})}) {
    EXPECT_EQ(RoundTrip(value), value) << Describe(value);
  }
}

// The library would write an integer by default.
TEST(MsgpackCodec, WritesADoubleAsADouble) {
  EXPECT_EQ(ToHex(EncodeMsgpack(1.0, ArrayKeys::kBytes)), "cb3ff0000000000000");
}

TEST(MsgpackCodec, ReadsWhatOtherEncodersWrite) {
  EXPECT_EQ(DecodeMsgpack(FromHex("ca3fc00000")), Value(1.5));                            // float32
  EXPECT_EQ(DecodeMsgpack(FromHex("cf8000000000000000")), Value(9223372036854775808.0));  // 2^63, unsigned
  EXPECT_EQ(DecodeMsgpack(FromHex("d30000000000000001")), Value(1));       // longer encoding than necessary
  EXPECT_EQ(DecodeMsgpack(FromHex("81c401780a")), Value(Map{{"x", 10}}));  // a key of bytes
}

Map ArrayMap(Value data, Value dtype, Value shape) {
  return {{"shape", std::move(shape)},
          {"dtype", std::move(dtype)},
          {"data", std::move(data)},
          {"__ndarray__", true}};
}

// The keys are text, and their order differs from the order in the vectors.
TEST(MsgpackCodec, ReadsArraysByTheNamesOfTheirKeys) {
  EXPECT_EQ(RoundTrip(ArrayMap(Bytes{0, 1, 2}, "|u1", List{3})), Value(kBytes012));
}

TEST(MsgpackCodec, TurnsBigEndianNumbers) {
  EXPECT_EQ(RoundTrip(ArrayMap(FromHex("3f000000bf800000"), ">f4", List{2})), Value(kHalfAndMinusOne));
}

// {b"__npgeneric__": True, b"data": 1.5, b"dtype": "<f8"}
TEST(MsgpackCodec, ReadsNumPyScalars) {
  EXPECT_EQ(
      DecodeMsgpack(FromHex("83c40d5f5f6e7067656e657269635f5fc3c40464617461cb3ff8000000000000c4056474797065"
                            "a33c6638")),
      Value(1.5));
}

// Written by Python's msgpack with msgpack-numpy: np.float32(1.5), np.bool_(True), np.array([0.5, -1],
// ">f4").
TEST(MsgpackCodec, ReadsNumPyScalarsAndBigEndianNumbersOfMsgpackNumpy) {
  EXPECT_EQ(DecodeMsgpack(FromHex("83c4026e64c2c40474797065a33c6634c40464617461c4040000c03f")),
            Value(Array{"<f4", {}, FromHex("0000c03f")}));
  EXPECT_EQ(DecodeMsgpack(FromHex("83c4026e64c2c40474797065a37c6231c40464617461c40101")),
            Value(Array{"|b1", {}, {1}}));
  EXPECT_EQ(
      DecodeMsgpack(FromHex("85c4026e64c3c40474797065a33e6634c4046b696e64c400c40573686170659102c40464617461"
                            "c4083f000000bf800000")),
      Value(kHalfAndMinusOne));
}

// np.zeros(1, dtype=[("a", "<f4")]) is not read as an array. Arrays of objects, which are pickles, are not
// read as arrays either.
TEST(MsgpackCodec, LeavesStructuredArraysOfMsgpackNumpyAsMaps) {
  const Value value = DecodeMsgpack(FromHex(
      "85c4026e64c3c404747970659192a161a33c6634c4046b696e64c40156c40573686170659101c40464617461c4040000"
      "0000"));
  ASSERT_TRUE(value.Is<Map>()) << Describe(value);
  EXPECT_EQ(*value.Find("kind"), Value(Bytes{'V'}));
  const Value map = Map{{"nd", 3}, {"type", "a"}};
  EXPECT_EQ(RoundTrip(map), map);
}

TEST(MsgpackCodec, ReportsThatArraysOfTextsAreNotRead) {
  EXPECT_EQ(RoundTrip(Map{{"names", ArrayMap(Bytes(32), "<U4", List{2})}, {"b", 1}}),
            Value(Map{{"names", "array <U4 [2] of texts is not supported"}, {"b", 1}}));
}

std::string Refusal(const Bytes& bytes) {
  try {
    return "read: " + Describe(DecodeMsgpack(bytes));
  } catch (const ServerError& error) {
    EXPECT_EQ(error.kind(), ServerError::Kind::kProtocol);
    return error.what();
  }
}
std::string Refusal(const Value& value) { return Refusal(EncodeMsgpack(value, ArrayKeys::kBytes)); }

TEST(MsgpackCodec, RefusesArraysThatDoNotFit) {
  EXPECT_EQ(Refusal(ArrayMap(Bytes(7), "<f4", List{2})),
            "array <f4 [2] has 7 bytes of data, which do not fit its type and shape");
  EXPECT_EQ(Refusal(ArrayMap(Bytes(12), "<f4", List{2})),
            "array <f4 [2] has 12 bytes of data, which do not fit its type and shape");
  EXPECT_EQ(Refusal(ArrayMap(Bytes(4), "<f4", List{-1})),
            "array <f4 [-1] has 4 bytes of data, which do not fit its type and shape");
  // Modulo 2^64, the product of the extents is 1, which would match the 4 bytes of data.
  EXPECT_THAT(Refusal(ArrayMap(Bytes(4), "<f4", List{274177, int64_t{67280421310721}})),
              HasSubstr("4 bytes"));
  EXPECT_THAT(Refusal(ArrayMap(Bytes(), "<f4", List{(int64_t{1} << 31) + 1, 0})), HasSubstr("0 bytes"));
  EXPECT_EQ(Refusal(ArrayMap(Bytes(8), "|O", List{1})), "array |O [1]: this number type is not supported");
  EXPECT_EQ(Refusal(ArrayMap("text", "|u1", List{4})),
            "MessagePack: an array's data are text \"text\", expected bytes");
  EXPECT_EQ(Refusal(ArrayMap(Bytes(8), 4, List{1})), "MessagePack: an array's dtype is 4, expected text");
  EXPECT_EQ(Refusal(ArrayMap(Bytes(8), "<f8", 1)), "MessagePack: an array's shape is 1, expected a list");
  EXPECT_EQ(Refusal(ArrayMap(Bytes(8), "<f8", List{1.0})),
            "MessagePack: an array's shape has 1, expected integers");
  EXPECT_EQ(Refusal(Map{{"nd", true}, {"type", "<f4"}, {"data", Bytes(4)}}),
            "MessagePack: an array without \"shape\"");
  EXPECT_EQ(Refusal(Map{{"nd", true}, {"type", "<f4"}, {"shape", List{2}}, {"data", Bytes(4)}}),
            "array <f4 [2] has 4 bytes of data, which do not fit its type and shape");
  EXPECT_EQ(Refusal(Map{{"nd", false}, {"type", "|O"}, {"data", Bytes(4)}}),
            "array |O []: this number type is not supported");
  EXPECT_EQ(Refusal(Map{{"__ndarray__", true}}), "MessagePack: an array without \"dtype\"");
  EXPECT_EQ(Refusal(Map{{"__npgeneric__", true}}), "MessagePack: an array without \"data\"");
}

TEST(MsgpackCodec, RefusesWhatIsNoMessage) {
  EXPECT_EQ(Refusal(Bytes{}), "MessagePack: it is truncated");
  EXPECT_EQ(Refusal(FromHex("92c0")), "MessagePack: it is truncated");
  EXPECT_EQ(Refusal(FromHex("c0c0")), "MessagePack: 1 byte after its end");
  EXPECT_THAT(Refusal(FromHex("c1")), HasSubstr("no valid value starts"));
  EXPECT_EQ(Refusal(FromHex("810102")), "MessagePack: a key is 1, expected text");
  EXPECT_EQ(Refusal(FromHex("819000")), "MessagePack: a key is list of 0, expected text");
  EXPECT_THAT(Refusal(FromHex("d40100")), HasSubstr("extension"));
  EXPECT_THAT(Refusal(FromHex("c9ffffffff01")), testing::StartsWith("MessagePack: "));
}

TEST(MsgpackCodec, EndsEveryPrefixOfAMessage) {
  for (const MsgpackVector& vector : kVectors) {
    const Bytes whole = FromHex(vector.hex);
    for (size_t size = 0; size < whole.size(); ++size) {
      EXPECT_EQ(Refusal(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))),
                "MessagePack: it is truncated");
    }
  }
}

TEST(MsgpackCodec, BoundsLevels) {
  Bytes nested(32, 0x91);  // 32 lists of one element and the contents of the innermost one
  nested.push_back(0xc0);
  EXPECT_EQ(Refusal(nested), "read: list of 1");
  nested.insert(nested.begin(), 0x91);
  EXPECT_EQ(Refusal(nested), "MessagePack: more than 32 levels");
  EXPECT_EQ(Refusal(Bytes(1000000, 0x91)), "MessagePack: more than 32 levels");
}

TEST(MsgpackCodec, BoundsTheNumberOfValues) {
  Bytes many = FromHex("dd00100000");  // 2^20 elements plus their list
  many.resize(many.size() + (1 << 20), 0xc0);
  EXPECT_EQ(Refusal(many), "MessagePack: more than a million values");
  many[2] = 0x0f, many[3] = 0xff, many[4] = 0xff;
  many.pop_back();
  EXPECT_EQ(Refusal(many), "read: list of 1048575");
}

// The messages are far too short for the announced 2^31 or more elements, pairs or bytes.
TEST(MsgpackCodec, AllocatesNothingForWhatIsOnlyAnnounced) {
  std::vector<Bytes> messages;
  for (const char* head :
       {"ddffffffff", "dfffffffff", "c6ffffffff", "dbffffffff", "c680000000", "c9fffffffe"}) {
    messages.push_back(FromHex(head));
    messages.back().resize(10);
  }
  Bytes nested;
  for (int level = 0; level < 31; ++level) {
    for (const uint8_t byte : FromHex("ddffffffff")) nested.push_back(byte);
  }
  messages.push_back(nested);
  for (const Bytes& message : messages) {
    const int64_t before = AllocatedBytes();
    const std::string refusal = Refusal(message);
    EXPECT_LT(AllocatedBytes() - before, 32 << 10) << ToHex(message);
    EXPECT_THAT(refusal, testing::StartsWith("MessagePack: ")) << ToHex(message);
  }
}

// Python's decoder uses the last value and others use the first, so the intended value is unknown.
TEST(Msgpack, RefusesAKeyTwice) {
  EXPECT_THAT(FailureOf([] { DecodeMsgpack(FromHex("82a16101a16102")); }),
              FailsAs(ServerError::Kind::kProtocol, "key \"a\" twice in a map"));
  EXPECT_THAT(FailureOf([] { DecodeMsgpack(FromHex("81a16282a16101a16101")); }),
              FailsAs(ServerError::Kind::kProtocol, "key \"a\" twice in a map"));
  EXPECT_EQ(DecodeMsgpack(FromHex("82a16181a16101a16202")), (Value(Map{{"a", Map{{"a", 1}}}, {"b", 2}})));
}

}  // namespace evalbus::policy::msgpack_codec_test
