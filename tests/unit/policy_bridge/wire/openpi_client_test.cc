#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "base/errors.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/websocket.h"
#include "tests/doubles/policy_server.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/policy_bridge/wire/double_client.h"
#include "tests/unit/policy_bridge/wire/hex.h"

namespace evalbus::policy::openpi_client_test {

using Kind = ServerError::Kind;
using Double = PolicyServerDouble;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::StartsWith;

const Value kObservation = Map{{"observation/image", Array{"|u1", {1, 1, 3}, {1, 2, 3}}},
                               {"observation/state", FloatArray({0.5, -1}, {2})},
                               {"prompt", "lift the pot"}};
const Value kChunk = Map{{"actions", FloatArray({0.5, -1}, {1, 2})}};

Double::Options Answering(Double::Answer answer) { return AlwaysAnswering(Wire::kOpenpi, std::move(answer)); }

ClientOptions To(const std::string& url) {
  ClientOptions options;
  options.url = url;
  return options;
}

struct Failure {
  Kind kind;
  std::string what, details;
};

// Returns the error without the address, which differs in each test.
template <class Function>
Failure FailureOf(const Function& function) {
  try {
    function();
  } catch (const ServerError& error) {
    const std::string what = error.what();
    const size_t end = what.find(": ");
    EXPECT_THAT(what, StartsWith("ws://"));
    EXPECT_EQ(what.find('\n'), std::string::npos);
    return {error.kind(), what.substr(end + 2), error.details()};
  }
  ADD_FAILURE() << "nothing failed";
  return {};
}

TEST(OpenpiClient, ExchangesObservationsForActions) {
  Double::Options options = Answering(Map{{"actions", FloatArray({0.5, -1}, {1, 2})},
                                          {"server_timing", Map{{"infer_ms", 1.5}}},
                                          {"state", nullptr}});
  options.greeting = Value(Map{{"reset_pose", List{0, -1.5}}});
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  EXPECT_FALSE(client->connected());
  EXPECT_EQ(client->Connect(), Value(Map{{"reset_pose", List{0, -1.5}}}));
  EXPECT_TRUE(client->connected());
  EXPECT_EQ(client->Name(), "openpi websocket");
  client->BeginEpisode("lift the pot", 0);
  for (int i = 0; i < 3; ++i) {
    const Reply reply = client->Infer(kObservation);
    EXPECT_EQ(*reply.value.Find("actions"), Value(FloatArray({0.5, -1}, {1, 2})));
    EXPECT_EQ(reply.server_s, 0.0015);
  }
  // The request contains only the observation and no information about the episode.
  EXPECT_THAT(server.Requests(), ElementsAre(kObservation, kObservation, kObservation));
}

TEST(OpenpiClient, SpeaksByTheSpecificationsVectors) {
  Double::Options options = Answering(Double::Message{
      FromHex("82a7616374696f6e7384c40b5f5f6e6461727261795f5fc3c40464617461c4080000003f000080bfc4056474797065"
              "a33c6634c4"
              "057368617065920102ad7365727665725f74696d696e6781a8696e6665725f6d73cb3ff8000000000000")});
  options.greeting = Double::Message{FromHex("80")};
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  EXPECT_EQ(client->Connect(), Value(Map{}));
  const Reply reply = client->Infer(Map{});
  EXPECT_EQ(*reply.value.Find("actions"), Value(FloatArray({0.5, -1}, {1, 2})));
  EXPECT_EQ(reply.server_s, 0.0015);
}

TEST(OpenpiClient, HasNoServerTimeIfNoneIsReported) {
  Double server(Answering(kChunk));
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  EXPECT_EQ(client->Infer(kObservation).server_s, std::nullopt);
}

TEST(OpenpiClient, HasNoServerTimeIfItIsNoNumber) {
  for (const double ms : {std::nan(""), std::numeric_limits<double>::infinity(), -1.0}) {
    Double server(
        Answering(Map{{"actions", FloatArray({0.5, -1}, {1, 2})}, {"server_timing", Map{{"infer_ms", ms}}}}));
    const auto client = MakePolicyClient(To(server.url()));
    client->Connect();
    EXPECT_EQ(client->Infer(kObservation).server_s, std::nullopt) << ms;
  }
}

TEST(OpenpiClient, KeepsPathAndKeyAndOffersNoCompression) {
  Double server(Answering(kChunk));
  ClientOptions options = To("ws://localhost:" + std::to_string(server.port()) + "/policy?name=pi0");
  options.api_key = "secret";
  MakePolicyClient(options)->Connect();
  MakePolicyClient(To(server.url() + "?name=pi0"))->Connect();
  const auto handshakes = server.Handshakes();
  ASSERT_EQ(handshakes.size(), 2u);
  EXPECT_EQ(handshakes[0].host, "localhost:" + std::to_string(server.port()));
  EXPECT_EQ(handshakes[0].target, "/policy?name=pi0");
  EXPECT_EQ(handshakes[0].authorization, "Api-Key secret");
  EXPECT_EQ(handshakes[1].target, "/?name=pi0");
  EXPECT_EQ(handshakes[1].authorization, "");
  for (const auto& handshake : handshakes) EXPECT_EQ(handshake.extensions, "");
}

// The messages are larger than Beast's default limits.
TEST(OpenpiClient, CarriesLargeMessages) {
  Double::Options options;
  options.answer = [](const Value& observation) { return observation; };
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  Bytes image(20 << 20);
  for (size_t i = 0; i < image.size(); ++i) image[i] = static_cast<uint8_t>(i * i >> 7);
  const Value observation = Map{{"image", Array{"|u1", {20, 1 << 20}, image}}};
  EXPECT_TRUE(client->Infer(observation).value == observation);
}

// A client may simulate for minutes without a request.
TEST(OpenpiClient, AnswersPingsWhileItIsIdle) {
  Double server(Answering(kChunk));
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  ASSERT_TRUE(server.WaitForConnections(1));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(server.Ping());
  EXPECT_EQ(client->Infer(kObservation).value, kChunk);
  EXPECT_TRUE(server.Ping());
}

TEST(OpenpiClient, SendsACloseFrameAtTheEnd) {
  Double server(Answering(kChunk));
  auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  ASSERT_TRUE(server.WaitForConnections(1));
  client.reset();
  EXPECT_TRUE(server.WaitForConnections(0));
  EXPECT_EQ(server.Goodbyes(), 1u);
}

// After the deadline, the client closes the connection without a close frame, because a server that does not
// read would block it.
TEST(OpenpiClient, PublishesNothingAfterADeadline) {
  Double server(Answering(Double::Nothing{}));
  ClientOptions to = To(server.url());
  to.first_reply_s = 0.1;
  const auto client = MakePolicyClient(to);
  client->Connect();
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).what, "no answer within 0.1 s");
  EXPECT_TRUE(server.WaitForConnections(0));
  EXPECT_EQ(server.Goodbyes(), 0u);
}

TEST(OpenpiClient, PassesOnTheServersText) {
  const std::string traceback =
      "Traceback (most recent call last):\n  File \"policy.py\", line 3\nValueError: Prompt is required\n";
  for (const Double::Answer& answer :
       {Double::Answer(Double::Error{traceback}), Double::Answer(Double::Text{traceback})}) {
    bool fails = true;
    Double::Options options;
    options.answer = [&](const Value&) { return fails ? answer : Double::Answer(kChunk); };
    Double server(options);
    const auto client = MakePolicyClient(To(server.url()));
    client->Connect();
    const Failure failure = FailureOf([&] { client->Infer(kObservation); });
    EXPECT_EQ(failure.kind, Kind::kServer);
    EXPECT_EQ(failure.what, "the server reports: ValueError: Prompt is required");
    EXPECT_EQ(failure.details, traceback);
    EXPECT_FALSE(client->connected());
    EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).what, "not connected");
    fails = false;
    client->Connect();
    EXPECT_EQ(client->Infer(kObservation).value, kChunk);
  }
}

TEST(OpenpiClient, ShowsTheWholeMessageOfAnException) {
  const auto shown = [](const std::string& text) { return std::string(ErrorFromServer(text).what()); };
  const std::string frames =
      "Traceback (most recent call last):\n  File \"policy.py\", line 3, in act\n    f()\n";
  EXPECT_EQ(shown(frames + "ValueError: my model broke\nsecond line\n\n  third\n"),
            "the server reports: ValueError: my model broke; second line; third");
  // The last of several chained exceptions is the error.
  EXPECT_EQ(shown(frames +
                  "KeyError: 1\n\nDuring handling of the above exception, another exception "
                  "occurred:\n\n" +
                  frames + "RuntimeError: no\n"),
            "the server reports: RuntimeError: no");
  EXPECT_EQ(shown("loading\r\nfailed\r\n"), "the server reports: failed");
}

TEST(OpenpiClient, PrintsNothingThatATerminalWouldObey) {
  Double server(Answering(Double::Text{"\x1b[31mno\x07\xff \n\n"}));
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  // A text message that is not UTF-8 is invalid in WebSocket.
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).kind, Kind::kProtocol);
  Double other(Answering(Double::Text{"\x1b[31mno\x07 \n\n"}));
  const auto second = MakePolicyClient(To(other.url()));
  second->Connect();
  EXPECT_EQ(FailureOf([&] { second->Infer(kObservation); }).what, "the server reports: ?[31mno?");
  Double empty(Answering(Double::Text{""}));
  const auto third = MakePolicyClient(To(empty.url()));
  third->Connect();
  EXPECT_EQ(FailureOf([&] { third->Infer(kObservation); }).what, "the server fails without a message");
}

struct Ending {
  const char* name;
  Double::Answer answer;
  Kind kind;
  const char* what;  // a regular expression
};

class OpenpiClientEndings : public testing::TestWithParam<Ending> {};

// A server may fail to answer in many ways. Each case ends with an error, and the client can connect again.
TEST_P(OpenpiClientEndings, AreDefined) {
  Double::Answer answer = GetParam().answer;
  Double::Options options;
  options.answer = [&](const Value&) { return answer; };
  Double server(options);
  ClientOptions to = To(server.url());
  to.max_reply_bytes = 1000;
  to.first_reply_s = GetParam().kind == Kind::kTimeout ? 0.1 : 60;
  const auto client = MakePolicyClient(to);
  client->Connect();
  const Failure failure = FailureOf([&] { client->Infer(kObservation); });
  EXPECT_EQ(failure.kind, GetParam().kind);
  EXPECT_THAT(failure.what, MatchesRegex(GetParam().what));
  EXPECT_FALSE(client->connected());
  EXPECT_TRUE(server.WaitForConnections(0));

  answer = kChunk;
  to.first_reply_s = 60;
  const auto again = MakePolicyClient(to);
  again->Connect();
  EXPECT_EQ(again->Infer(kObservation).value, kChunk);
}

INSTANTIATE_TEST_SUITE_P(
    All, OpenpiClientEndings,
    testing::Values(
        Ending{"Silence", Double::Nothing{}, Kind::kTimeout, "no answer within 0.1 s"},
        Ending{"Gone", Double::Gone(), Kind::kUnreachable, "the connection was lost \\(.*\\)"},
        Ending{"Close", Double::Close{1001, "shutting down"}, Kind::kUnreachable,
               "the server closed the connection \\(1001: shutting down\\)"},
        Ending{"HalfFrame", Double::HalfFrame(), Kind::kProtocol,
               "the connection ended in the middle of a message"},
        Ending{"HalfFrameAndSilence", Double::Raw{{0x82, 5, 0x81}, false}, Kind::kTimeout,
               "no answer within 0.1 s"},
        Ending{"Announced2GB", Double::Announced2GB(), Kind::kProtocol,
               "an answer of more than 1000 bytes, which is the limit"},
        Ending{"TooLong", Double::Message{Bytes(1001)}, Kind::kProtocol,
               "an answer of more than 1000 bytes, which is the limit"},
        Ending{"NoFrame", Double::Raw{{0x83, 0}, false}, Kind::kProtocol, "not a websocket message \\(.*\\)"},
        Ending{"Masked", Double::Raw{{0x82, 0x81, 0, 0, 0, 0, 0x80}, false}, Kind::kProtocol,
               "not a websocket message \\(.*\\)"},
        Ending{"NoMsgpack", Double::Message{{0xc1}}, Kind::kProtocol, "MessagePack: .*"},
        Ending{"Empty", Double::Message{}, Kind::kProtocol, "MessagePack: it is truncated"},
        Ending{"HugeArray", Double::Message{FromHex("ddffffffff00")}, Kind::kProtocol, "MessagePack: .*"},
        Ending{"NoMap", Value(List{1, 2}), Kind::kReply, "answers with list of 2, not with a map"}),
    [](const auto& ending) { return ending.param.name; });

TEST(OpenpiClient, AllocatesNothingForAFrameThatIsOnlyAnnounced) {
  Double server(Answering(Double::Announced2GB()));
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  const int64_t before = AllocatedBytes();
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).what,
            "an answer of more than 268435456 bytes, which is the limit");
  EXPECT_LT(AllocatedBytes() - before, 1 << 20);
}

TEST(OpenpiClient, GivesTheFirstAnswerItsOwnTime) {
  bool answers = true;
  Double::Options options;
  options.answer = [&](const Value&) { return answers ? Double::Answer(kChunk) : Double::Nothing{}; };
  Double server(options);
  ClientOptions to = To(server.url());
  to.first_reply_s = 60;
  to.reply_s = 0.1;
  const auto client = MakePolicyClient(to);
  client->Connect();
  client->Infer(kObservation);
  answers = false;
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).what, "no answer within 0.1 s");

  to.first_reply_s = 0.2;
  to.reply_s = 60;
  const auto other = MakePolicyClient(to);
  other->Connect();
  EXPECT_EQ(FailureOf([&] { other->Infer(kObservation); }).what, "no answer within 0.2 s");
}

TEST(OpenpiClient, RefusesAnUnrequestedMessage) {
  for (const bool is_text : {true, false}) {
    Double server(Answering(kChunk));
    const auto client = MakePolicyClient(To(server.url()));
    client->Connect();
    ASSERT_TRUE(server.WaitForConnections(1));
    server.SendUnrequested(is_text ? "RuntimeError: out of memory" : "\x80", is_text);
    ASSERT_TRUE(server.Ping());  // when Ping() returns, the client has read the message
    const Failure failure = FailureOf([&] { client->Infer(kObservation); });
    EXPECT_EQ(failure.kind, is_text ? Kind::kServer : Kind::kProtocol);
    EXPECT_EQ(failure.what, is_text ? "the server reports: RuntimeError: out of memory"
                                    : "sent an unexpected message: map of 0");
    EXPECT_EQ(server.Requests().size(), 0u);
  }
}

TEST(OpenpiClient, EndsWithAServerThatDoesNotStop) {
  Double::Options options = Answering(kChunk);
  Double::Raw flood;
  for (int i = 0; i < 100; ++i) flood.bytes.insert(flood.bytes.end(), {0x82, 1, 0x80});
  options.greeting = flood;
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  try {
    client->Connect();
    ASSERT_TRUE(server.WaitForConnections(0));
    client->Infer(kObservation);
    ADD_FAILURE();
  } catch (const ServerError& error) {
    EXPECT_EQ(error.kind(), Kind::kProtocol) << error.what();
  }
  EXPECT_FALSE(client->connected());
}

TEST(OpenpiClient, ConnectsAgainToARestartedServer) {
  Double server(Answering(kChunk));
  ClientOptions to = To(server.url());
  const auto client = MakePolicyClient(to);
  client->Connect();
  EXPECT_EQ(client->Infer(kObservation).value, kChunk);
  server.Stop();
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).kind, Kind::kUnreachable);
  EXPECT_FALSE(client->connected());
  const Failure refused = FailureOf([&] { client->Connect(); });
  EXPECT_EQ(refused.kind, Kind::kUnreachable);
  EXPECT_EQ(refused.what, "connection refused: is the policy server running there?");
  server.Start();
  client->Connect();
  EXPECT_EQ(client->Infer(kObservation).value, kChunk);
}

TEST(OpenpiClient, ExpectsMetadataFirst) {
  const auto failure_with = [](const Double::Answer& greeting) {
    Double::Options options = Answering(kChunk);
    options.greeting = greeting;
    Double server(options);
    ClientOptions to = To(server.url());
    to.connect_s = std::holds_alternative<Double::Nothing>(greeting) ? 1 : 60;
    const auto client = MakePolicyClient(to);
    const Failure failure = FailureOf([&] { client->Connect(); });
    EXPECT_FALSE(client->connected());
    return failure;
  };
  Failure failure = failure_with(Double::Nothing{});
  EXPECT_EQ(failure.kind, Kind::kProtocol);
  EXPECT_EQ(failure.what,
            "no metadata, which an openpi server sends first, within 1 s: does the server use another wire "
            "protocol?");
  failure = failure_with(Value(List{}));
  EXPECT_EQ(failure.kind, Kind::kProtocol);
  EXPECT_EQ(failure.what, "sends list of 0 first; an openpi server sends a map of its metadata first");
  failure = failure_with(Double::Error{"no model"});
  EXPECT_EQ(failure.kind, Kind::kServer);
  EXPECT_EQ(failure.what, "the server reports: no model");
  EXPECT_EQ(failure_with(Double::Message{{0xc1}}).kind, Kind::kProtocol);
  EXPECT_EQ(failure_with(Double::Gone()).kind, Kind::kUnreachable);
}

TEST(OpenpiClient, ReportsWhatAnswersInsteadOfAWebsocket) {
  for (const auto& [status, kind, what] : std::vector<std::tuple<int, Kind, std::string>>{
           {404, Kind::kProtocol, "HTTP 404 Not Found and no websocket: is the path right?"},
           {401, Kind::kServer, "HTTP 401 Unauthorized: is the API key right?"},
           {503, Kind::kUnreachable, "HTTP 503 Service Unavailable: the server behind this proxy is down"},
           {0, Kind::kProtocol, "no websocket answers there (bad version)"},
           {-1, Kind::kTimeout, "no answer to the websocket handshake within 1 s"}}) {
    Double::Options options = Answering(kChunk);
    options.http_status = status;
    Double server(options);
    ClientOptions to = To(server.url());
    to.connect_s = status < 0 ? 1 : 60;
    const Failure failure = FailureOf([&] { MakePolicyClient(to)->Connect(); });
    EXPECT_EQ(failure.kind, kind) << status;
    EXPECT_EQ(failure.what, what);
  }
}

TEST(OpenpiClient, IsNotConnectedBeforeItConnects) {
  const auto client = MakePolicyClient(To("ws://127.0.0.1:1"));
  const Failure failure = FailureOf([&] { client->Infer(kObservation); });
  EXPECT_EQ(failure.kind, Kind::kUnreachable);
  EXPECT_EQ(failure.what, "not connected");
}

// Some servers reset the state of an episode when a connection opens, because openpi's protocol has no
// message for the start of an episode.
TEST(OpenpiClient, EachEpisodeHasAConnectionOfItsOwn) {
  Double server(Answering(kChunk));
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  client->BeginEpisode("lift", 0);
  EXPECT_EQ(server.Handshakes().size(), 1u) << "the connection is fresh";
  for (size_t episode = 1; episode < 4; ++episode) {
    client->Infer(kObservation);
    client->Infer(kObservation);
    client->BeginEpisode("lift", static_cast<int64_t>(episode));
    EXPECT_EQ(server.Handshakes().size(), episode + 1);
    EXPECT_EQ(client->Infer(kObservation).value, kChunk);
  }
  // If the server has ended in the meantime, this is detected immediately.
  server.Stop();
  EXPECT_EQ(FailureOf([&] { client->BeginEpisode("lift", 4); }).kind, Kind::kUnreachable);
}

TEST(RoboArena, IsRecognizedByItsActionSpace) {
  Double::Options options = Answering(kChunk);
  options.wire = Wire::kRoboArena;
  options.greeting = Value(Map{{"action_space", "joint_position"}, {"needs_session_id", true}});
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  EXPECT_EQ(client->Name(), "RoboArena websocket");
  for (int episode = 0; episode < 2; ++episode) {
    client->BeginEpisode("lift", episode);
    EXPECT_EQ(client->Infer(kObservation).value, kChunk);
    EXPECT_EQ(client->Infer(kObservation).value, kChunk);
  }
  const std::vector<Value> requests = server.Requests();
  ASSERT_EQ(requests.size(), 6u);
  std::vector<std::string> sessions;
  for (size_t i = 0; i < requests.size(); ++i) {
    EXPECT_EQ(*requests[i].Find("endpoint"), Value(i % 3 == 0 ? "reset" : "infer"));
    sessions.push_back(*requests[i].Find("session_id")->As<std::string>());
    EXPECT_EQ(requests[i].Find("prompt") != nullptr, i % 3 != 0);
  }
  EXPECT_EQ(sessions[0], sessions[1]);
  EXPECT_EQ(sessions[0], sessions[2]);
  EXPECT_EQ(sessions[3], sessions[5]);
  EXPECT_NE(sessions[0], sessions[3]);
  EXPECT_THAT(sessions[3], MatchesRegex("evalbus-episode1-[0-9a-f]{16}"));
}

TEST(RoboArena, IsSpokenWhereItIsDemanded) {
  Double::Options options = Answering(Value(FloatArray({1, 2}, {1, 2})));
  options.wire = Wire::kRoboArena;
  Double server(options);
  ClientOptions to = To(server.url());
  to.wire = Wire::kRoboArena;
  const auto client = MakePolicyClient(to);
  client->Connect();
  client->BeginEpisode("lift", 0);
  // openpi's first servers sent a bare array.
  EXPECT_EQ(client->Infer(kObservation).value, Value(Map{{"actions", FloatArray({1, 2}, {1, 2})}}));
  EXPECT_EQ(server.Requests()[0], Value(Map{{"endpoint", "reset"}}));
  EXPECT_EQ(server.Requests()[1].Find("session_id"), nullptr);
}

TEST(RoboArena, HasOneAnswerToAReset) {
  const auto failure_with = [](const Double::Answer& reset) {
    Double::Options options = Answering(kChunk);
    options.wire = Wire::kRoboArena;
    options.greeting = Value(Map{{"action_space", "joint_position"}});
    options.reset = reset;
    Double server(options);
    const auto client = MakePolicyClient(To(server.url()));
    client->Connect();
    const Failure failure = FailureOf([&] { client->BeginEpisode("lift", 0); });
    EXPECT_FALSE(client->connected());
    return failure;
  };
  Failure failure = failure_with(Double::Error{"Traceback\nKeyError: 'x'"});
  EXPECT_EQ(failure.kind, Kind::kServer);
  EXPECT_EQ(failure.what, "the server reports: KeyError: 'x'");
  EXPECT_EQ(failure_with(Double::Text{"reset successful "}).kind, Kind::kServer);
  failure = failure_with(Value(Map{}));
  EXPECT_EQ(failure.kind, Kind::kProtocol);
  EXPECT_EQ(failure.what, "answers a reset with map of 0, expected \"reset successful\"");
}

// vLLM-Omni has an endpoint for robot policies (vllm_omni/entrypoints/openpi/connection.py). This is its
// first message for DreamZero, an answer that is a bare array, and maps where RoboArena's own server sends
// texts.
TEST(RoboArena, IsServedByVllmOmni) {
  Double::Options options = Answering(Value(FloatArray({1, 2}, {1, 2})));
  options.wire = Wire::kRoboArena;
  options.greeting = Value(Map{{"image_resolution", List{180, 320}},
                               {"n_external_cameras", 2},
                               {"needs_wrist_camera", true},
                               {"needs_stereo_camera", false},
                               {"needs_session_id", true},
                               {"action_space", "joint_position"}});
  options.reset = Value(Map{{"status", "reset successful"}});
  Double server(options);
  const auto client = MakePolicyClient(To(server.url() + "/v1/realtime/robot/openpi"));
  client->Connect();
  EXPECT_EQ(server.Handshakes()[0].target, "/v1/realtime/robot/openpi");
  EXPECT_EQ(client->Name(), "RoboArena websocket");
  client->BeginEpisode("lift", 0);
  EXPECT_EQ(client->Infer(kObservation).value, Value(Map{{"actions", FloatArray({1, 2}, {1, 2})}}));
  EXPECT_NE(server.Requests()[1].Find("session_id"), nullptr);
}

TEST(RoboArena, HasErrorsOfVllmOmni) {
  const Value error = Map{{"type", "error"}, {"message", "Internal inference error"}};
  Double::Options options = Answering(error);
  options.wire = Wire::kRoboArena;
  options.greeting = Value(Map{{"action_space", "joint_position"}});
  options.reset = error;
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  for (const Failure& failure : {FailureOf([&] { client->BeginEpisode("lift", 0); }),
                                 FailureOf([&] { client->Infer(kObservation); })}) {
    EXPECT_EQ(failure.kind, Kind::kServer);
    EXPECT_EQ(failure.what, "the server reports: Internal inference error");
  }
  EXPECT_TRUE(client->connected()) << "the server continues";
}

// A text instead of actions, such as the answer to a reset, is an error.
TEST(RoboArena, HasNoTextForAnAnswer) {
  Double::Options options = Answering(Double::Text{"reset successful"});
  options.wire = Wire::kRoboArena;
  options.greeting = Value(Map{{"action_space", "joint_position"}});
  Double server(options);
  const auto client = MakePolicyClient(To(server.url()));
  client->Connect();
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }).kind, Kind::kServer);
}

TEST(WebsocketUrl, HasHostPortAndTarget) {
  const auto parts = [](const std::string& url) {
    const Url parsed = ParseUrl(url, "ws");
    return std::vector{parsed.text, parsed.host, parsed.port, parsed.target};
  };
  EXPECT_THAT(parts("ws://localhost:8000"), ElementsAre("ws://localhost:8000", "localhost", "8000", ""));
  EXPECT_THAT(parts("ws://10.0.0.1:80/a/b?c=d"),
              ElementsAre("ws://10.0.0.1:80/a/b?c=d", "10.0.0.1", "80", "/a/b?c=d"));
  EXPECT_THAT(parts("ws://[::1]:8000/"), ElementsAre("ws://[::1]:8000/", "::1", "8000", "/"));
}

TEST(WebsocketUrl, IsRefusedWithTheReason) {
  const auto refusal = [](const std::string& url) -> std::string {
    try {
      MakePolicyClient(To(url));
      return "taken";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(refusal("localhost:8000"), "localhost:8000: wrong scheme; expected ws://HOST:PORT");
  EXPECT_THAT(refusal("http://localhost:8000"), HasSubstr("wrong scheme"));
  EXPECT_EQ(refusal("wss://localhost:8000"),
            "wss://localhost:8000: TLS is not supported; use a proxy that terminates it, or a tunnel (ssh "
            "-L); expected "
            "ws://HOST:PORT");
  EXPECT_THAT(refusal("ws://localhost"), HasSubstr("no port"));
  EXPECT_THAT(refusal("ws://[::1]"), HasSubstr("no port"));
  EXPECT_THAT(refusal("ws://[::1"), HasSubstr("no port"));
  EXPECT_THAT(refusal("ws://[::1]8000"), HasSubstr("no port"));
  EXPECT_THAT(refusal("ws://::1:8000"), HasSubstr("must be in []"));
  EXPECT_THAT(refusal("ws://"), HasSubstr("no port"));
  EXPECT_THAT(refusal("ws://:8000"), HasSubstr("no host"));
  EXPECT_THAT(refusal("ws://[]:8000"), HasSubstr("no host"));
  EXPECT_THAT(refusal("ws://[:8000"), HasSubstr("no port"));
  for (const char* port : {"", "0", "65536", "123456", "80a", "-1"}) {
    EXPECT_THAT(refusal("ws://localhost:" + std::string(port)), HasSubstr("not a valid port"));
  }
  EXPECT_THAT(refusal("ws://me:secret@localhost:8000"), HasSubstr("password"));
  EXPECT_THAT(refusal("ws://localhost:8000/a b"), HasSubstr("a space"));
  EXPECT_THAT(refusal("ws://localhost:8000/\r\nX: y"), HasSubstr("a control character"));
  EXPECT_EQ(refusal("ws://localhost:65535/x"), "taken");
}

TEST(ApiKey, HasNoLineBreaks) {
  ClientOptions options = To("ws://localhost:8000");
  options.api_key = "a\r\nHost: other";
  EXPECT_THROW(MakePolicyClient(options), InputError);
}

}  // namespace evalbus::policy::openpi_client_test
