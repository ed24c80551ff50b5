// Compares messages from and to a Foxglove viewer with bytes written out by hand.
#include "export/foxglove_protocol.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace evalbus::exports::foxglove_protocol_test {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::Pair;
using namespace std::string_literals;

TEST(Foxglove, ChoosesASubprotocolThatTheClientOffers) {
  EXPECT_EQ(ChooseSubprotocol("foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(ChooseSubprotocol("x, foxglove.websocket.v1 ,foxglove.sdk.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(ChooseSubprotocol("foxglove.sdk.v2"), "");
  EXPECT_EQ(ChooseSubprotocol(""), "");
  EXPECT_EQ(ChooseSubprotocol(",,"), "");
}

TEST(Foxglove, ReadsMessagesOfAClient) {
  const auto subscribe = ParseClientText(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":4294967295,"channelId":0}]})");
  ASSERT_TRUE(subscribe);
  EXPECT_THAT(subscribe->subscribe, ElementsAre(Pair(7, 2), Pair(4294967295, 0)));
  const auto unsubscribe = ParseClientText(R"({"op":"unsubscribe","subscriptionIds":[7,8]})");
  ASSERT_TRUE(unsubscribe);
  EXPECT_THAT(unsubscribe->unsubscribe, ElementsAre(7, 8));
  const auto other = ParseClientText(R"({"op":"getParameters","parameterNames":[]})");
  ASSERT_TRUE(other);
  EXPECT_TRUE(other->subscribe.empty() && other->unsubscribe.empty());
  for (const char* wrong :
       {"", "[]", "{}", "{\"op\":1}", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":[{"id":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":0}]})",
        R"({"op":"unsubscribe","subscriptionIds":{}})", R"({"op":"unsubscribe","subscriptionIds":[1.5]})"}) {
    EXPECT_FALSE(ParseClientText(wrong)) << wrong;
  }
}

// Pause, speed 0.5 (0x3f000000), seek to 0x0102 ns, request id "ab".
const std::string kControl = "\x03\x01\0\0\0\x3f\x01\x02\x01\0\0\0\0\0\0\x02\0\0\0ab"s;

TEST(Foxglove, ReadsPlaybackControl) {
  const auto control = ParsePlaybackControl(kControl);
  ASSERT_TRUE(control);
  EXPECT_FALSE(control->play);
  EXPECT_EQ(control->speed, 0.5F);
  EXPECT_EQ(control->seek_ns, 0x0102U);
  EXPECT_EQ(control->request_id, "ab");
  // The message is truncated at any position, or it is longer than it states.
  for (size_t size = 0; size < kControl.size(); ++size) {
    EXPECT_FALSE(ParsePlaybackControl(kControl.substr(0, size))) << size;
  }
  EXPECT_FALSE(ParsePlaybackControl(kControl + "c"));
  for (const auto& [at, byte] : {std::pair(0, '\x02'), std::pair(1, '\x02'), std::pair(6, '\x02'),
                                 std::pair(5, '\xbf')}) {  // unknown type, command and flag; speed -0.5
    std::string wrong = kControl;
    wrong[static_cast<size_t>(at)] = byte;
    EXPECT_FALSE(ParsePlaybackControl(wrong)) << at;
  }
  std::string no_seek = kControl;
  no_seek[6] = 0;
  EXPECT_FALSE(ParsePlaybackControl(no_seek)->seek_ns);
}

TEST(Foxglove, EncodesBinaryMessages) {
  EXPECT_EQ(MessageBytes(0x0a, 0x0203, "{}"), "\x01\x0a\0\0\0\x03\x02\0\0\0\0\0\0{}"s);
  EXPECT_EQ(TimeBytes(0x0203), "\x02\x03\x02\0\0\0\0\0\0"s);
  EXPECT_EQ(PlaybackStateBytes({PlaybackStatus::kEnded, 5, 2, true, "q"}),
            "\x05\x03\x05\0\0\0\0\0\0\0\0\0\0\x40\x01\x01\0\0\0q"s);
}

TEST(Foxglove, EncodesTextMessages) {
  using nlohmann::json;
  EXPECT_EQ(json::parse(ServerInfoText("n", "s", 1'500'000'000)),
            json::parse(R"({"op":"serverInfo","name":"n","capabilities":["time","playbackControl"],
                            "supportedEncodings":["json"],"metadata":{},"sessionId":"s",
                            "dataStartTime":{"sec":0,"nsec":0},"dataEndTime":{"sec":1,"nsec":500000000}})"));
  EXPECT_EQ(json::parse(ServerInfoText("n", "s", {}))["capabilities"], json::parse(R"(["time"])"));
  EXPECT_EQ(json::parse(AdvertiseText({{"/a", "A", "{}"}, {"/b", "B", "{\"x\":1}"}}, 1)),
            json::parse(R"({"op":"advertise","channels":[{"id":1,"topic":"/b","encoding":"json",
                            "schemaName":"B","schemaEncoding":"jsonschema","schema":"{\"x\":1}"}]})"));
  EXPECT_EQ(json::parse(UnadvertiseText({3})), json::parse(R"({"op":"unadvertise","channelIds":[3]})"));
}

TEST(Foxglove, PlaysPausesSeeksAndEnds) {
  const Playback::Time start{};
  Playback playback(10'000'000'000);  // 10 s
  EXPECT_EQ(playback.State(start + milliseconds(500)).status, PlaybackStatus::kPaused);
  EXPECT_EQ(playback.State(start + milliseconds(500)).time_ns, 0);

  PlaybackState state = playback.Control({.play = true, .speed = 2, .seek_ns = {}, .request_id = "1"}, start);
  EXPECT_EQ(state.status, PlaybackStatus::kPlaying);
  EXPECT_EQ(state.request_id, "1");
  EXPECT_FALSE(state.did_seek);
  EXPECT_EQ(playback.State(start + milliseconds(500)).time_ns, 1'000'000'000);

  state = playback.Control({.play = false, .speed = 1, .seek_ns = {}, .request_id = ""},
                           start + milliseconds(750));
  EXPECT_EQ(state.time_ns, 1'500'000'000);
  EXPECT_EQ(playback.State(start + milliseconds(5000)).time_ns, 1'500'000'000);

  state = playback.Control({.play = false, .speed = 1, .seek_ns = UINT64_MAX, .request_id = ""}, start);
  EXPECT_EQ(state.time_ns, 10'000'000'000);
  EXPECT_TRUE(state.did_seek);
  state = playback.Control({.play = true, .speed = 1, .seek_ns = 9'000'000'000, .request_id = ""}, start);
  EXPECT_EQ(playback.State(start + milliseconds(999)).status, PlaybackStatus::kPlaying);
  EXPECT_EQ(playback.State(start + milliseconds(1000)).status, PlaybackStatus::kEnded);
  EXPECT_EQ(playback.State(start + milliseconds(60000)).time_ns, 10'000'000'000);
  // After the end, playing starts again at the beginning.
  state = playback.Control({.play = true, .speed = 1, .seek_ns = {}, .request_id = ""},
                           start + milliseconds(2000));
  EXPECT_EQ(state.time_ns, 0);
  EXPECT_TRUE(state.did_seek);
}

}  // namespace evalbus::exports::foxglove_protocol_test
