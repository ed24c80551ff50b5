#include <gmock/gmock.h>

#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/codecs.h"
#include "tests/doubles/policy_server.h"
#include "tests/unit/policy_bridge/wire/double_client.h"
#include "tests/unit/policy_bridge/wire/hex.h"

namespace evalbus::policy::vla_eval_client_test {

using Kind = ServerError::Kind;
using Double = PolicyServerDouble;
using testing::ElementsAre;
using testing::EndsWith;

const Value kObservation = Map{{"images", Map{{"head", Array{"|u1", {1, 1, 3}, {1, 2, 3}}}}},
                               {"states", FloatArray({0.5, -1}, {2})},
                               {"task_description", "lift"}};
const Value kAction = Map{{"actions", FloatArray({0.5, -1}, {2})}};

Double::Options Answering(Double::Answer answer) {
  return AlwaysAnswering(Wire::kVlaEval, std::move(answer));
}

std::unique_ptr<PolicyClient> ClientOf(const Double& server, double connect_s = 60,
                                       double first_reply_s = 60) {
  return ClientOfWire(Wire::kVlaEval, server, connect_s, first_reply_s);
}

// Returns the kind of the ServerError that `function` throws. Its text must end with ": " and `end`.
template <class Function>
Kind FailureOf(const Function& function, const std::string& end) {
  try {
    function();
  } catch (const ServerError& error) {
    EXPECT_THAT(error.what(), EndsWith(": " + end));
    return error.kind();
  }
  ADD_FAILURE() << "nothing failed";
  return {};
}

std::vector<std::string> Types(const std::vector<Value>& messages) {
  std::vector<std::string> types;
  for (const Value& message : messages) types.push_back(*message.Find("type")->As<std::string>());
  return types;
}

TEST(VlaEvalClient, HoldsEpisodes) {
  Double::Options options = Answering(kAction);
  options.greeting = Value(Map{{"model_server", "OpenVLA"}, {"action_spec", Map{{"arm", Map{{"dims", 7}}}}}});
  Double server(options);
  const auto client = ClientOf(server);
  const Value hello = client->Connect();
  EXPECT_EQ(*hello.Find("model_server"), Value("OpenVLA"));
  EXPECT_EQ(*hello.Find("action_spec")->Find("arm")->Find("dims"), Value(7));
  EXPECT_EQ(client->Name(), "vla-eval websocket");
  client->BeginEpisode("lift", 3);
  EXPECT_EQ(client->Infer(kObservation).value, kAction);
  EXPECT_EQ(client->Infer(kObservation).server_s, std::nullopt);
  client->BeginEpisode("lower", 4);
  EXPECT_EQ(client->Infer(kObservation).value, kAction);

  const std::vector<Value> messages = server.Requests();
  EXPECT_THAT(Types(messages), ElementsAre("hello", "episode_start", "observation", "observation",
                                           "episode_end", "episode_start", "observation"));
  for (size_t i = 0; i < messages.size(); ++i) {
    EXPECT_EQ(*messages[i].Find("seq"), Value(static_cast<int64_t>(i)));
    EXPECT_TRUE(messages[i].Find("timestamp")->Is<double>());
  }
  EXPECT_EQ(*messages[0].Find("payload"),
            Value(Map{{"harness_version", "evalbus"}, {"protocol_version", 1}}));
  EXPECT_EQ(*messages[2].Find("payload"), kObservation);
  EXPECT_EQ(*messages[5].Find("payload"),
            Value(Map{{"task", Map{{"name", "lower"}, {"task_description", "lower"}, {"episode_idx", 4}}}}));
}

// The specification's action answers message 2, the observation. Message 0 is the hello, and message 1 starts
// the episode.
TEST(VlaEvalClient, ReadsTheSpecificationsVector) {
  Double server(
      Answering(Double::Message{FromHex("84a474797065a6616374696f6ea77061796c6f616481a7616374696f6e7384ab5f5f"
                                        "6e6461727261795f5fc3a464617461c40800"
                                        "00003f000080bfa56474797065a33c6634a573686170659102a373657102a974696d"
                                        "657374616d70cb0000000000000000")}));
  const auto client = ClientOf(server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  EXPECT_EQ(client->Infer(kObservation).value, kAction);
}

TEST(VlaEvalClient, SurvivesTheServersErrors) {
  bool fails = true;
  Double::Options options = Answering(kAction);
  options.answer = [&](const Value&) {
    return fails ? Double::Answer(Double::Error{"observation_failed: KeyError: 'wrist'"})
                 : Double::Answer(kAction);
  };
  Double server(options);
  const auto client = ClientOf(server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); },
                      "the server reports: observation_failed: KeyError: 'wrist'"),
            Kind::kServer);
  EXPECT_TRUE(client->connected());
  fails = false;
  EXPECT_EQ(client->Infer(kObservation).value, kAction);
  EXPECT_EQ(server.Handshakes().size(), 1u);
}

// The error of episode_start arrives while the client waits for an action. The action that follows must not
// be taken for the answer to the next request.
TEST(VlaEvalClient, DistinguishesErrorsOfEpisodesAndActions) {
  int observations = 0;
  Double::Options options = Answering(kAction);
  options.episode_start = Double::Error{"episode_start_failed: no such task"};
  options.answer = [&](const Value&) { return Value(Map{{"actions", ++observations}}); };
  Double server(options);
  const auto client = ClientOf(server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); },
                      "the server reports: episode_start_failed: no such task"),
            Kind::kServer);
  EXPECT_EQ(client->Infer(kObservation).value, Value(Map{{"actions", 2}}));
}

TEST(VlaEvalClient, TakesNoOtherAnswer) {
  const auto message = [](const char* type, int seq) {
    return Double::Message{EncodeMsgpack(
        Map{{"type", type}, {"payload", Map{}}, {"seq", seq}, {"timestamp", 0.0}}, ArrayKeys::kTexts)};
  };
  const auto check = [](const Double::Answer& answer, Kind kind, const std::string& what) {
    Double server(Answering(answer));
    const auto client = ClientOf(server, 60, kind == Kind::kTimeout ? 0.1 : 60);
    client->Connect();
    EXPECT_EQ(FailureOf([&] { client->Infer(kObservation); }, what), kind);
    EXPECT_FALSE(client->connected());
    EXPECT_TRUE(server.WaitForConnections(0));
  };
  check(message("action", 2), Kind::kProtocol,
        "answers observation 1 with a message of type action and number 2");
  check(message("hello", 1), Kind::kProtocol,
        "answers observation 1 with a message of type hello and number 1");
  check(message("action", 0), Kind::kTimeout, "no answer within 0.1 s");
  check(Double::Nothing{}, Kind::kTimeout, "no answer within 0.1 s");
  check(Double::Message{FromHex("80")}, Kind::kProtocol,
        "sends map of 0; vla-eval's messages have type, payload and seq");
  check(Double::Message{FromHex("c1")}, Kind::kProtocol, "MessagePack: no valid value starts at byte 0");
  check(Double::Text{"Traceback\nboom"}, Kind::kServer, "the server reports: boom");
  check(Double::HalfFrame(), Kind::kProtocol, "the connection ended in the middle of a message");
}

TEST(VlaEvalClient, ExpectsAnAnnouncement) {
  const auto check = [](const Double::Answer& greeting, Kind kind, const std::string& what) {
    Double::Options options = Answering(kAction);
    options.greeting = greeting;
    Double server(options);
    const auto client = ClientOf(server, std::holds_alternative<Double::Nothing>(greeting) ? 1 : 60);
    EXPECT_EQ(FailureOf([&] { client->Connect(); }, what), kind);
    EXPECT_FALSE(client->connected());
  };
  check(Double::Nothing{}, Kind::kProtocol, "does the server use another wire protocol?");
  check(Double::Error{"not ready"}, Kind::kServer, "the server reports: not ready");
  check(Value(Map{{"protocol_version", 2}}), Kind::kProtocol,
        "uses version 2 of vla-eval's protocol, evalbus uses 1");
  check(Double::Close{1011, "no"}, Kind::kUnreachable, "no)");
  // An openpi server sends its metadata, here an empty map, before the client has sent anything.
  check(Double::Message{FromHex("80")}, Kind::kProtocol,
        "sends map of 0; vla-eval's messages have type, payload and seq");
}

TEST(VlaEvalClient, BeginsAnewWhenItConnectsAgain) {
  Double server(Answering(kAction));
  const auto client = ClientOf(server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  client->Infer(kObservation);
  server.Stop();
  EXPECT_THROW(client->Infer(kObservation), ServerError);
  server.Start();
  client->Connect();
  client->BeginEpisode("lift", 0);
  EXPECT_EQ(client->Infer(kObservation).value, kAction);
  const std::vector<Value> messages = server.Requests();
  EXPECT_THAT(Types(messages),
              ElementsAre("hello", "episode_start", "observation", "hello", "episode_start", "observation"));
  EXPECT_EQ(*messages[3].Find("seq"), Value(0));
}

}  // namespace evalbus::policy::vla_eval_client_test
