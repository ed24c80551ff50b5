#include <gmock/gmock.h>

#include <set>

#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/codecs.h"
#include "tests/doubles/policy_server.h"
#include "tests/unit/policy_bridge/wire/double_client.h"
#include "tests/unit/policy_bridge/wire/hex.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::xpolicylab_client_test {

using Kind = ServerError::Kind;
using Double = PolicyServerDouble;
using testing::ElementsAre;
using testing::EndsWith;

const Value kObservation = Map{{"state", Map{{"left_arm_joint_state", FloatArray({0.5, -1}, {2})}}},
                               {"instruction", "lift"},
                               {"env_idx", 0}};

Value Action(double arm, double gripper) {
  return Map{{"left_arm_joint_state", FloatArray({arm, -1}, {2})}, {"left_ee_joint_state", gripper}};
}
const Value kActions = Map{{"actions", List{Action(0.5, 1), Action(0.25, 0)}}};

Double::Options Answering(Double::Answer answer) {
  return AlwaysAnswering(Wire::kXPolicyLab, std::move(answer));
}

std::unique_ptr<PolicyClient> ClientOf(const Double& server, double connect_s = 60,
                                       double first_reply_s = 60) {
  return ClientOfWire(Wire::kXPolicyLab, server, connect_s, first_reply_s);
}

std::string TextOf(const Value& message, const char* key) {
  const auto* text = message.Find(key)->As<std::string>();
  return text ? *text : "none";
}

std::vector<std::string> Types(const std::vector<Value>& messages) {
  std::vector<std::string> types;
  for (const Value& message : messages) types.push_back(TextOf(message, "message_type"));
  return types;
}

TEST(XPolicyLabClient, HoldsTrials) {
  Double::Options options = Answering(kActions);
  options.greeting = Value(Map{{"ok", true}, {"server", "demo"}});
  Double server(options);
  auto client = ClientOf(server);
  EXPECT_EQ(*client->Connect().Find("server"), Value("demo"));
  EXPECT_EQ(client->Name(), "XPolicyLab websocket");
  client->BeginEpisode("lift", 3);
  EXPECT_EQ(
      client->Infer(kObservation).value,
      Value(Map{{"left_arm_joint_state", FloatArray({0.5, -1, 0.25, -1}, {2, 2})},
                {"left_ee_joint_state", Array{"<f8", {2, 1}, FromHex("000000000000f03f0000000000000000")}}}));
  client->Infer(kObservation);
  client->BeginEpisode("lift", 4);
  client->Infer(kObservation);
  client->BeginEpisode("lower", 5);
  client.reset();
  EXPECT_TRUE(server.WaitForConnections(0));

  const std::vector<Value> messages = server.Requests();
  ASSERT_THAT(Types(messages),
              ElementsAre("hello", "prepare_case", "reset", "infer", "infer", "trial_end", "reset", "infer",
                          "trial_end", "prepare_case", "reset", "trial_end", "close"));
  std::set<std::string> ids, evaluations, trials;
  for (const Value& message : messages) {
    ids.insert(TextOf(message, "message_id"));
    evaluations.insert(TextOf(message, "evaluation_id"));
    trials.insert(TextOf(message, "trial_id"));
  }
  EXPECT_EQ(ids.size(), messages.size());
  EXPECT_EQ(evaluations.size(), 1u);
  EXPECT_EQ(trials.size(), 4u);  // three trials, and messages without a trial
  EXPECT_EQ(*messages[0].Find("payload"), Value(Map{}));
  EXPECT_EQ(*messages[0].Find("action_case_id"), Value());
  EXPECT_EQ(*messages[1].Find("payload"), Value(Map{{"action_case_id", "lift"}, {"instruction", "lift"}}));
  EXPECT_EQ(*messages[1].Find("trial_id"), Value());
  EXPECT_EQ(*messages[9].Find("action_case_id"), Value("lower"));
  for (const size_t reset : {2u, 6u, 10u}) {
    const Value trial = *messages[reset].Find("trial_id");
    EXPECT_EQ(*messages[reset].Find("payload"), Value(Map{{"trial_id", trial}}));
    const size_t end = reset == 2 ? 5 : reset == 6 ? 8 : 11;
    EXPECT_EQ(*messages[end].Find("trial_id"), trial);
    EXPECT_EQ(*messages[end].Find("payload"), Value(Map{{"trial_id", trial}}));
  }
  EXPECT_THAT(TextOf(messages[6], "trial_id"), EndsWith("-episode4"));
  EXPECT_EQ(*messages[6].Find("repeat_index"), Value(4));
  EXPECT_EQ(*messages[3].Find("payload"), Value(Map{{"observation", kObservation}}));
  EXPECT_EQ(*messages[3].Find("repeat_index"), Value());
  EXPECT_EQ(*messages[3].Find("step"), Value(0));
  EXPECT_EQ(*messages[4].Find("step"), Value(1));
  EXPECT_EQ(*messages[7].Find("step"), Value(0));
  EXPECT_EQ(*messages[12].Find("payload")->Find("reason"), Value("the evaluation has ended"));
}

// Python's msgpack, with msgpack-numpy, wrote this infer_result. The id of its request is 0.
TEST(XPolicyLabClient, ReadsWhatPythonWrites) {
  const std::string before =
      "89ac6d6573736167655f74797065ac696e6665725f726573756c74ad6576616c756174696f6e5f6964a165ae616374696f6e5f"
      "636173655f6964c0a8747269616c5f6964a174ac7265706561745f696e646578c0a47374657000a773656e745f6174b9323032"
      "362d30312d30315430303a30303a30302b30303a3030aa6d6573736167655f6964";
  const std::string after =
      "a77061796c6f616482a7616374696f6e739282b46c6566745f61726d5f6a6f696e745f737461746585c4026e64c3c404747970"
      "65a33c6634c4046b696e64c400c40573686170659102c40464617461c4080000003f000080bfb36c6566745f65655f6a6f696e"
      "745f737461746585c4026e64c3c40474797065a33c6634c4046b696e64c400c40573686170659101c40464617461c404000080"
      "3f82b46c6566745f61726d5f6a6f696e745f737461746585c4026e64c3c40474797065a33c6634c4046b696e64c400c4057368"
      "6170659102c40464617461c4080000803e00000040b36c6566745f65655f6a6f696e745f737461746585c4026e64c3c4047479"
      "7065a33c6634c4046b696e64c400c40573686170659101c40464617461c40400000000aa6c6174656e63795f6d73cb40290000"
      "00000000";
  Double::Options options;
  std::optional<Double> server;
  options.wire = Wire::kXPolicyLab;
  options.answer = [&](const Value&) {
    const std::string id = TextOf(server->Requests().back(), "message_id");
    Bytes bytes = FromHex(before);
    bytes.push_back(static_cast<uint8_t>(0xa0 | id.size()));
    EXPECT_LT(id.size(), 32u);
    bytes.insert(bytes.end(), id.begin(), id.end());
    for (const uint8_t byte : FromHex(after)) bytes.push_back(byte);
    return Double::Message{bytes};
  };
  server.emplace(options);
  const auto client = ClientOf(*server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  const Reply reply = client->Infer(kObservation);
  EXPECT_EQ(reply.value, Value(Map{{"left_arm_joint_state", FloatArray({0.5, -1, 0.25, 2}, {2, 2})},
                                   {"left_ee_joint_state", FloatArray({1, 0}, {2, 1})}}));
  EXPECT_EQ(reply.server_s, 0.0125);
}

TEST(XPolicyLabClient, ReportsEachTypeOfError) {
  const auto check = [](const std::string& code, const std::string& line) {
    bool fails = true;
    Double::Options options = Answering(kActions);
    options.answer = [&](const Value&) {
      return fails ? Double::Answer(Double::Error{"Traceback\nKeyError: 'vision'", code})
                   : Double::Answer(kActions);
    };
    Double server(options);
    const auto client = ClientOf(server);
    client->Connect();
    client->BeginEpisode("lift", 0);
    const ServerError error = FailureOf([&] { client->Infer(kObservation); });
    EXPECT_EQ(error.what(), server.url() + ": " + line + "; the server reports: KeyError: 'vision'");
    EXPECT_EQ(error.kind(), Kind::kServer);
    EXPECT_EQ(error.details(), "Traceback\nKeyError: 'vision'");
    // The connection is still usable.
    fails = false;
    EXPECT_NO_THROW(client->Infer(kObservation));
    EXPECT_EQ(server.Handshakes().size(), 1u);
  };
  check("invalid_frame", "the server cannot read the request infer (invalid_frame)");
  check("unknown_message_type", "the server does not support the request infer (unknown_message_type)");
  check("timeout", "the request infer exceeded the server's own time limit (timeout)");
  check("infer_failed", "the model's inference failed (infer_failed)");
  check("reset_failed", "the model's reset failed (reset_failed)");
  check("internal", "the request infer caused an internal error of the server (internal)");
  check("out_of\nmemory", "the request infer failed (out_of?memory)");
  check("", "the request infer failed (no error code)");
}

TEST(XPolicyLabClient, ReportsErrorsOfEpisodes) {
  std::string failing = "reset";
  Double::Options options = Answering(kActions);
  options.control = [&](const std::string& type) {
    return type == failing
               ? Double::Answer(Double::Error{"no memory", type == "reset" ? "reset_failed" : "internal"})
               : Double::Answer(Value(Map{{"ok", true}}));
  };
  Double server(options);
  const auto client = ClientOf(server);
  client->Connect();
  EXPECT_THAT(
      FailureOf([&] { client->BeginEpisode("lift", 0); }),
      FailsAs(Kind::kServer, "the model's reset failed (reset_failed); the server reports: no memory"));
  failing = "prepare_case";
  EXPECT_THAT(
      FailureOf([&] { client->BeginEpisode("lower", 0); }),
      FailsAs(Kind::kServer, "the request prepare_case caused an internal error of the server (internal)"));
  failing = "";
  client->BeginEpisode("lower", 0);
  failing = "trial_end";
  EXPECT_THAT(
      FailureOf([&] { client->BeginEpisode("lower", 1); }),
      FailsAs(Kind::kServer, "the request trial_end caused an internal error of the server (internal)"));
  failing = "";
  // Ending the trial has failed, and the client does not try it again.
  client->BeginEpisode("lower", 1);
  EXPECT_THAT(Types(server.Requests()),
              ElementsAre("hello", "prepare_case", "reset", "trial_end", "prepare_case", "prepare_case",
                          "reset", "trial_end", "reset"));
}

TEST(XPolicyLabClient, TakesNoOtherAnswer) {
  const auto check = [](const Double::Answer& answer, Kind kind, const std::string& what) {
    Double server(Answering(answer));
    const auto client = ClientOf(server, 60, kind == Kind::kTimeout ? 0.5 : 60);
    client->Connect();
    EXPECT_THAT(FailureOf([&] { client->Infer(kObservation); }), FailsAs(kind, what));
    EXPECT_FALSE(client->connected());
    EXPECT_TRUE(server.WaitForConnections(0));
  };
  const auto message = [](const char* type, const char* id) {
    return Double::Message{EncodeMsgpack(Map{{"message_type", type}, {"message_id", id}, {"payload", Map{}}},
                                         ArrayKeys::kMsgpackNumpy)};
  };
  check(message("infer_result", "7"), Kind::kProtocol,
        "answers infer with a message for another request, text \"7\"");
  check(Double::Nothing{}, Kind::kTimeout, "no answer within 0.5 s");
  check(Double::Message{FromHex("80")}, Kind::kProtocol,
        "answers infer with map of 0; XPolicyLab's messages have message_type, message_id and payload");
  check(Double::Message{FromHex("c1")}, Kind::kProtocol, "MessagePack: no valid value starts at byte 0");
  check(Double::HalfFrame(), Kind::kProtocol, "the connection ended in the middle of a message");
  check(Value(Map{{"latency_ms", 3.0}}), Kind::kReply, "answers with map of 1, which has no \"actions\"");
  const auto actions = [](List list) { return Value(Map{{"actions", std::move(list)}}); };
  check(actions({Action(1, 1), 3}), Kind::kReply, "action 1 of the answer is 3, not a map");
  check(actions({Action(1, 1), Map{}}), Kind::kReply, "action 1 of the answer has 0 keys, action 0 has 2");
  check(actions({Map{{"a", 1}}, Map{{"b", 1}}}), Kind::kReply,
        "'b' in action 1 of the answer is not in action 0");
  check(actions({Map{{"a", "up"}}}), Kind::kReply,
        "'a' in action 0 of the answer is text \"up\", expected numbers");
  check(actions({Map{{"a", List{1, "up"}}}}), Kind::kReply, "'a' in action 0 of the answer is list of 2");
  check(actions({Map{{"a", List{1, 2}}}, Map{{"a", List{1}}}}), Kind::kReply,
        "'a' in action 1 of the answer is array <f8 [1], which differs from action 0");
  check(actions({Map{{"a", 1}}, Map{{"a", FloatArray({1}, {1})}}}), Kind::kReply,
        "'a' in action 1 of the answer is array <f4 [1], which differs from action 0");
}

// A policy may also answer with a single array.
TEST(XPolicyLabClient, PassesOtherActionsOn) {
  for (const Value& latency_ms : {Value(250.0), Value(250)}) {
    const Value actions = Map{{"actions", FloatArray({1, 2}, {1, 2})}, {"latency_ms", latency_ms}};
    Double server(Answering(actions));
    const auto client = ClientOf(server);
    client->Connect();
    const Reply reply = client->Infer(kObservation);
    EXPECT_EQ(reply.value, actions);
    EXPECT_EQ(reply.server_s, 0.25);
  }
}

TEST(XPolicyLabClient, ExpectsAnAcknowledgment) {
  const auto check = [](const Double::Answer& greeting, Kind kind, const std::string& what) {
    Double::Options options = Answering(kActions);
    options.greeting = greeting;
    Double server(options);
    const auto client = ClientOf(server, std::holds_alternative<Double::Nothing>(greeting) ? 1 : 60);
    EXPECT_THAT(FailureOf([&] { client->Connect(); }), FailsAs(kind, what));
  };
  check(Double::Nothing{}, Kind::kProtocol, "does the server use another wire protocol?");
  check(Double::Error{"not ready", "internal"}, Kind::kServer,
        "the request hello caused an internal error of the server (internal); the server reports: not ready");
  check(Double::Close{1011, "no"}, Kind::kUnreachable, "no)");
  // An openpi server sends a message first: here, an empty map.
  check(Double::Message{FromHex("80")}, Kind::kProtocol, "answers hello with map of 0");
}

TEST(XPolicyLabClient, EndsATrialThatALostConnectionInterrupted) {
  Double server(Answering(kActions));
  const auto client = ClientOf(server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  client->Infer(kObservation);
  server.Stop();
  EXPECT_THROW(client->Infer(kObservation), ServerError);
  server.Start();
  client->Connect();
  client->BeginEpisode("lift", 0);
  client->Infer(kObservation);
  const std::vector<Value> messages = server.Requests();
  ASSERT_THAT(Types(messages), ElementsAre("hello", "prepare_case", "reset", "infer", "hello", "trial_end",
                                           "prepare_case", "reset", "infer"));
  EXPECT_EQ(*messages[5].Find("trial_id"), *messages[2].Find("trial_id"));
  EXPECT_NE(*messages[7].Find("trial_id"), *messages[2].Find("trial_id"));
}

// A server that does not acknowledge the end of the last trial delays the client's end only briefly.
TEST(XPolicyLabClient, EndsWithoutAnAcknowledgment) {
  bool is_silent = false;
  Double::Options options = Answering(kActions);
  options.control = [&](const std::string&) {
    return is_silent ? Double::Answer(Double::Nothing{}) : Double::Answer(Value(Map{{"ok", true}}));
  };
  Double server(options);
  auto client = ClientOf(server);
  client->Connect();
  client->BeginEpisode("lift", 0);
  is_silent = true;
  client.reset();
  EXPECT_TRUE(server.WaitForConnections(0));
  EXPECT_THAT(Types(server.Requests()), ElementsAre("hello", "prepare_case", "reset", "trial_end"));
}

}  // namespace evalbus::policy::xpolicylab_client_test
