#include <gtest/gtest.h>

#include "policy_bridge/wire/codecs.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::groot_codec_test {

using Kind = ServerError::Kind;

std::string Text(const std::string& text) {
  return ToHex({static_cast<uint8_t>(0xa0 + text.size())}) + ToHex(Bytes(text.begin(), text.end()));
}

TEST(GrootCodec, WritesAndReadsRequests) {
  const std::vector<std::pair<Value, std::string>> vectors = {
      {Map{{"endpoint", "ping"}}, "81a8656e64706f696e74a470696e67"},
      {Map{{"endpoint", "get_modality_config"}},
       "81a8656e64706f696e74b36765745f6d6f64616c6974795f636f6e666967"},
      {Map{{"endpoint", "get_action"},
           {"data", Map{{"observation",
                         Map{{"state", Map{{"x", Array{"<f4", {1, 1, 2}, FromHex("0000003f000080bf")}}}}}},
                        {"options", nullptr}}}},
       "82a8656e64706f696e74aa6765745f616374696f6ea46461746182ab6f62736572766174696f6e81a5737461746581a17882b"
       "15f5f"
       "6e6461727261795f636c6173735f5fc3a661735f6e7079c488" +
           ToHex(EncodeNpy({"<f4", {1, 1, 2}, FromHex("0000003f000080bf")})) + "a76f7074696f6e73c0"},
  };
  for (const auto& [value, hex] : vectors) {
    EXPECT_EQ(ToHex(EncodeGroot(value)), hex);
    EXPECT_EQ(DecodeGroot(FromHex(hex)), value) << hex;
  }
}

TEST(GrootCodec, ReadsAModalityConfigurationInAllItsForms) {
  const Value expected = Map{{"delta_indices", List{0}}, {"modality_keys", List{"front"}}};
  // {"delta_indices": [0], "modality_keys": ["front"]}
  const std::string content =
      "82" + Text("delta_indices") + "9100" + Text("modality_keys") + "91" + Text("front");
  const std::string mark = "82" + Text("__ModalityConfig_class__") + "c3";
  EXPECT_EQ(DecodeGroot(FromHex(mark + Text("as_json") + content)), expected);
  EXPECT_EQ(DecodeGroot(FromHex(mark + Text("as_dict") + content)), expected);
  const std::string json = R"({"delta_indices": [0], "modality_keys": ["front"]})";
  EXPECT_EQ(DecodeGroot(FromHex(mark + Text("as_json") + "d9" + ToHex({static_cast<uint8_t>(json.size())}) +
                                ToHex(Bytes(json.begin(), json.end())))),
            expected);
  EXPECT_EQ(DecodeGroot(FromHex(content)), expected);
}

TEST(GrootCodec, RefusesWhatItCannotRead) {
  const auto failure = [](const std::string& hex) { return FailureOf([&] { DecodeGroot(FromHex(hex)); }); };
  const std::string array = Text("__ndarray_class__") + "c3";
  EXPECT_THAT(failure("81" + array), FailsAs(Kind::kProtocol, ".npy"));
  EXPECT_THAT(failure("82" + array + Text("as_npy") + Text("no")), FailsAs(Kind::kProtocol, ".npy"));
  EXPECT_THAT(failure("82" + array + Text("as_npy") + "c4020102"), FailsAs(Kind::kProtocol, ".npy"));
  const std::string modality = Text("__ModalityConfig_class__") + "c3";
  EXPECT_THAT(failure("81" + modality), FailsAs(Kind::kProtocol, "modality"));
  EXPECT_THAT(failure("82" + modality + Text("as_json") + "01"), FailsAs(Kind::kProtocol, "modality"));
  EXPECT_THAT(failure("82" + modality + Text("as_json") + Text("{")), FailsAs(Kind::kProtocol, "JSON"));
  EXPECT_THAT(failure(""), FailsAs(Kind::kProtocol, ""));
  EXPECT_THAT(failure("80c0"), FailsAs(Kind::kProtocol, "after its end"));
  // Each header announces 2^32 - 1 elements, pairs or bytes.
  EXPECT_EQ(failure("ddffffffff01").kind(), Kind::kProtocol);
  EXPECT_EQ(failure("dfffffffff").kind(), Kind::kProtocol);
  EXPECT_EQ(failure("c6ffffffff00").kind(), Kind::kProtocol);
}

TEST(GrootCodec, RefusesEveryMessageCutShort) {
  const Bytes whole =
      EncodeGroot(Map{{"x", Array{"<f4", {1, 1, 2}, Bytes(8)}}, {"y", List{1, 2.5, "three", nullptr}}});
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(FailureOf([&] { DecodeGroot({whole.data(), size}); }).kind(), Kind::kProtocol) << size;
  }
}

}  // namespace evalbus::policy::groot_codec_test
