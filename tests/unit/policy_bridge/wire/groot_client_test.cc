#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/codecs.h"
#include "tests/doubles/groot_server.h"
#include "tests/doubles/rest_server.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::groot_client_test {

using Dialect = ClientOptions::GrootDialect;
using Kind = ServerError::Kind;
using doubles::GrootServer;
using Form = GrootServer::Options::Configuration;
using testing::HasSubstr;

constexpr const char* kTask = "annotation.human.task_description";

Value Observation() {
  return Map{{"video.front", Array{"|u1", {1, 1, 2, 3}, {1, 2, 3, 4, 5, 6}}},
             {"state.arm", FloatArray({0.5, -1.0}, {1, 2})},
             {"state.gripper", FloatArray({0.25}, {1, 1})},
             {kTask, "lift the pot"}};
}

ClientOptions To(const GrootServer& server) {
  ClientOptions options;
  options.wire = Wire::kGroot;
  options.url = server.url();
  return options;
}

// Returns the endpoints of the requests so far, in order.
std::vector<std::string> Endpoints(const GrootServer& server) {
  std::vector<std::string> endpoints;
  for (const Value& request : server.requests())
    endpoints.push_back(*request.Find("endpoint")->As<std::string>());
  return endpoints;
}

// Returns the test server's actions for Observation(): rows of the arm's state + i, and rows of i.
void ExpectActions(const Value& actions, int horizon = 3) {
  std::vector<double> arm, gripper;
  for (int i = 0; i < horizon; ++i) {
    arm.insert(arm.end(), {0.5 + i, -1.0 + i});
    gripper.push_back(i);
  }
  EXPECT_EQ(actions, Value(Map{{"arm", FloatArray(arm, {horizon, 2})},
                               {"gripper", FloatArray(gripper, {horizon, 1})}}));
}

struct Spoken {
  Dialect dialect;
  Form form;
  const char* name;
};

class GrootDialects : public testing::TestWithParam<Spoken> {
 protected:
  GrootServer::Options ServerOptions() const { return {GetParam().dialect, 3, GetParam().form, "", 0}; }
};

TEST_P(GrootDialects, AreFoundAndSpoken) {
  const GrootServer server(ServerOptions());
  const auto client = MakePolicyClient(To(server));
  EXPECT_FALSE(client->connected());
  const Value configuration = client->Connect();
  EXPECT_TRUE(client->connected());
  const auto modality = [](List keys, List indices) {
    return Map{{"delta_indices", std::move(indices)}, {"modality_keys", std::move(keys)}};
  };
  EXPECT_EQ(configuration, Value(Map{{"video", modality({"front"}, {0})},
                                     {"state", modality({"arm", "gripper"}, {0})},
                                     {"action", modality({"arm", "gripper"}, {0, 1, 2})},
                                     {"language", modality({kTask}, {0})}}));
  ExpectActions(client->Infer(Observation()).value);
  EXPECT_EQ(client->Name(), GetParam().name);
  // The client caches what it discovered about the server, so each further inference needs only one request.
  const size_t asked = server.requests().size();
  ExpectActions(client->Infer(Observation()).value);
  EXPECT_EQ(server.requests().size(), asked + 1);
}

TEST_P(GrootDialects, MayBeGiven) {
  const GrootServer server(ServerOptions());
  ClientOptions options = To(server);
  options.groot_dialect = GetParam().dialect;
  const auto client = MakeGrootClient(options);
  EXPECT_EQ(client->Name(), GetParam().name);
  client->Connect();
  ExpectActions(client->Infer(Observation()).value);
  EXPECT_EQ(Endpoints(server), (std::vector<std::string>{"ping", "get_modality_config", "get_action"}));
}

TEST_P(GrootDialects, BeginEpisodesWithAResetWhereThereIsOne) {
  const GrootServer server(ServerOptions());
  const auto client = MakeGrootClient(To(server));
  client->Connect();
  client->BeginEpisode("lift the pot", 0);
  const bool has_reset = GetParam().dialect != Dialect::kN15;
  EXPECT_EQ(Endpoints(server).back(), has_reset ? "reset" : "get_modality_config");
}

INSTANTIATE_TEST_SUITE_P(All, GrootDialects,
                         testing::Values(Spoken{Dialect::kN15, Form::kJsonText, "GR00T N1.5"},
                                         Spoken{Dialect::kN16, Form::kMap, "GR00T N1.6"},
                                         Spoken{Dialect::kN16, Form::kDict, "GR00T N1.6"},
                                         Spoken{Dialect::kN16Flat, Form::kMap, "GR00T N1.6 (flat)"}));

// Checks the batch and the requests as the server receives them.
TEST(GrootClient, SendsEachDialectItsForm) {
  const Array front = {"|u1", {1, 1, 2, 3}, {1, 2, 3, 4, 5, 6}}, arm = FloatArray({0.5, -1.0}, {1, 2}),
              gripper = FloatArray({0.25}, {1, 1});
  const auto batched = [](Array array) {
    array.shape.insert(array.shape.begin(), 1);
    return array;
  };
  const auto enveloped = [](Map observation) {
    return Value(Map{{"observation", std::move(observation)}, {"options", nullptr}});
  };
  const std::vector<std::pair<Dialect, Value>> expected = {
      {Dialect::kN15, Map{{"video.front", front},
                          {"state.arm", arm},
                          {"state.gripper", gripper},
                          {kTask, List{"lift the pot"}}}},
      {Dialect::kN16, enveloped({{"video", Map{{"front", batched(front)}}},
                                 {"state", Map{{"arm", batched(arm)}, {"gripper", batched(gripper)}}},
                                 {"language", Map{{kTask, List{Value(List{"lift the pot"})}}}}})},
      {Dialect::kN16Flat, enveloped({{"video.front", batched(front)},
                                     {"state.arm", batched(arm)},
                                     {"state.gripper", batched(gripper)},
                                     {kTask, List{"lift the pot"}}})},
  };
  for (const auto& [dialect, data] : expected) {
    const GrootServer server({dialect, 3, Form::kMap, "", 0});
    const auto client = MakeGrootClient(To(server));
    client->Connect();
    // Doubles are converted to floats.
    Value observation = Observation();
    (*observation.As<Map>())[1].second = Array{"<f8", {1, 2}, FromHex("000000000000e03f000000000000f0bf")};
    client->Infer(observation);
    EXPECT_EQ(*server.requests().back().Find("data"), data);
  }
}

TEST(GrootClient, UnderstandsWhatN15LeavesOut) {
  for (const int horizon : {1, 2, 3}) {
    const GrootServer server({Dialect::kN15, horizon, Form::kJsonText, "", 0});
    const auto client = MakeGrootClient(To(server));
    client->Connect();
    ExpectActions(client->Infer(Observation()).value, horizon);
  }
}

TEST(GrootClient, TriesFlatObservationsOnceAndOnlyIfTheServerRequiresThem) {
  GrootServer server({Dialect::kN16, 3, Form::kMap, "", 0});
  const auto client = MakeGrootClient(To(server));
  client->Connect();
  const auto error = [&](const std::string& words) {
    server.AnswerNextWith("get_action", EncodeGroot(Map{{"error", words}}));
  };
  error("Video key 'front' must be in observation");
  EXPECT_THAT(FailureOf([&] { client->Infer(Observation()); }), FailsAs(Kind::kServer, "Video key 'front'"));
  EXPECT_EQ(Endpoints(server).size(), 3u);
  error("Video key 'video.front' must be in observation");
  error("Video key 'video.front' must be in observation");
  EXPECT_THAT(FailureOf([&] { client->Infer(Observation()); }),
              FailsAs(Kind::kServer, "Video key 'video.front'"));
  EXPECT_EQ(Endpoints(server).size(), 5u);
  EXPECT_TRUE(client->connected());
}

TEST(GrootClient, UsesTheNestedDialectIfNoModalitiesAreGiven) {
  const GrootServer server({Dialect::kN16, 3, Form::kNone, "", 0});
  const auto client = MakeGrootClient(To(server));
  EXPECT_EQ(client->Connect(), Value(Map{}));
  ExpectActions(client->Infer(Observation()).value);
}

TEST(GrootClient, SendsItsToken) {
  const GrootServer server({Dialect::kN16, 3, Form::kMap, "secret", 0});
  ClientOptions options = To(server);
  options.api_key = "secret";
  const auto client = MakeGrootClient(options);
  client->Connect();
  ExpectActions(client->Infer(Observation()).value);
  options.api_key = "";
  const auto other = MakeGrootClient(options);
  EXPECT_THAT(FailureOf([&] { other->Connect(); }),
              FailsAs(Kind::kServer, "Unauthorized: Invalid API token"));
  EXPECT_FALSE(other->connected());
}

TEST(GrootClient, RefusesObservationsThatAreNone) {
  const GrootServer server({});
  const auto client = MakeGrootClient(To(server));
  client->Connect();
  const auto refused = [&](const char* key, Value value) {
    try {
      client->Infer(Map{{key, std::move(value)}});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refused("video.front", Array{"|u1", {1, 2, 3}, Bytes(6)}),
              HasSubstr("video.front: array |u1 [1, 2, 3]"));
  EXPECT_THAT(refused("video.front", FloatArray(std::vector<double>(6), {1, 1, 2, 3})), HasSubstr("<f4"));
  EXPECT_THAT(refused("video.front", Array{"|u1", {1, 1, 2, 4}, Bytes(8)}), HasSubstr("[1, 1, 2, 4]"));
  EXPECT_THAT(refused("state.arm", FloatArray({1, 2}, {2})), HasSubstr("state.arm: array <f4 [2]"));
  EXPECT_THAT(refused("state.arm", 1.5), HasSubstr("state.arm: 1.5"));
  EXPECT_THAT(refused("arm", FloatArray({1}, {1, 1})), HasSubstr("arm: array"));
  EXPECT_THROW(client->Infer("lift"), InputError);
  EXPECT_TRUE(client->connected());  // nothing was sent
  EXPECT_EQ(Endpoints(server).size(), 2u);
}

TEST(GrootClient, RefusesOtherUrls) {
  for (const char* url :
       {"", "ws://127.0.0.1:5555", "tcp://127.0.0.1", "tcp://127.0.0.1:0", "tcp://127.0.0.1:70000",
        "tcp://:5555", "tcp://127.0.0.1:5555/act", "tcp://::1:5555", "tcp://a b:5555"}) {
    ClientOptions options;
    options.url = url;
    EXPECT_THROW(MakeGrootClient(options), InputError) << url;
  }
  ClientOptions options;
  options.url = "tcp://[::1]:5555";
  EXPECT_NO_THROW(MakeGrootClient(options));
}

// The following tests concern faults.

class GrootFaults : public testing::Test {
 protected:
  GrootFaults() : server_(std::make_unique<GrootServer>(GrootServer::Options{})) { Connect(60); }
  void Connect(double first_reply_s) {
    ClientOptions options = To(*server_);
    options.first_reply_s = first_reply_s;
    options.max_reply_bytes = 20'000;
    client_ = MakeGrootClient(options);
    client_->Connect();
  }
  ServerError Failure() {
    return FailureOf([&] { client_->Infer(Observation()); });
  }
  void Publish(const Value& value) { server_->AnswerNextWith("get_action", EncodeGroot(value)); }

  std::unique_ptr<GrootServer> server_;
  std::unique_ptr<PolicyClient> client_;
};

TEST_F(GrootFaults, AServerThatReportsAnErrorMayBeCalledAgain) {
  server_->AnswerNextWith("get_action", {'E', 'R', 'R', 'O', 'R'});
  EXPECT_THAT(Failure(), FailsAs(Kind::kServer, "the server reports: ERROR"));
  Publish(Map{{"error", "Traceback (most recent call last):\n  File \"x.py\"\nCUDA out of memory\n"}});
  const ServerError error = Failure();
  EXPECT_THAT(error, FailsAs(Kind::kServer, "the server reports: CUDA out of memory"));
  EXPECT_THAT(error.details(), HasSubstr("File \"x.py\""));
  Publish(Map{{"error", List{1}}});
  EXPECT_THAT(Failure(), FailsAs(Kind::kServer, "list of 1"));
  Publish(Map{{"error", ""}});
  EXPECT_THAT(Failure(), FailsAs(Kind::kServer, "without a message"));
  EXPECT_TRUE(client_->connected());
  ExpectActions(client_->Infer(Observation()).value);
}

TEST_F(GrootFaults, AnswersOfAnotherFormCloseIt) {
  const auto refused = [&](const Value& answer) {
    client_->Connect();
    Publish(answer);
    const ServerError error = Failure();
    EXPECT_FALSE(client_->connected());
    return error;
  };
  EXPECT_THAT(refused("nonsense"), FailsAs(Kind::kReply, "text \"nonsense\""));
  EXPECT_THAT(refused(nullptr), FailsAs(Kind::kReply, "nothing"));
  EXPECT_THAT(refused(Map{{"action.arm", FloatArray({1, 2}, {1, 2})}}), FailsAs(Kind::kReply, "map of 1"));
  EXPECT_THAT(refused(List{Value(Map{}), Value(Map{})}), FailsAs(Kind::kReply, "without any action"));
  const auto arm = [](Array array) { return List{Value(Map{{"arm", std::move(array)}}), Value(Map{})}; };
  EXPECT_THAT(refused(arm(FloatArray({1, 2}, {2}))), FailsAs(Kind::kReply, "action arm is array <f4 [2]"));
  EXPECT_THAT(refused(arm(FloatArray({1, 2}, {2, 1, 1}))), FailsAs(Kind::kReply, "[2, 1, 1]"));
  EXPECT_THAT(refused(arm(FloatArray({1, 2}, {1, 1, 1, 2}))), FailsAs(Kind::kReply, "[1, 1, 1, 2]"));
}

TEST_F(GrootFaults, BytesOfNoMessageCloseIt) {
  server_->AnswerNextWith("get_action", {0xc1, 0xff});
  EXPECT_EQ(Failure().kind(), Kind::kProtocol);
  EXPECT_FALSE(client_->connected());
  EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "not connected"));
  client_->Connect();
  Bytes half = EncodeGroot(List{Value(Map{{"arm", FloatArray({1, 2}, {1, 1, 2})}}), Value(Map{})});
  half.resize(half.size() / 2);
  server_->AnswerNextWith("get_action", half);
  EXPECT_EQ(Failure().kind(), Kind::kProtocol);
}

TEST_F(GrootFaults, AnAnswerThatIsTooLongIsNotRead) {
  Publish(List{Value(Map{{"arm", FloatArray(std::vector<double>(10'000), {1, 5000, 2})}}), Value(Map{})});
  EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "more than 20000 bytes"));
  EXPECT_FALSE(client_->connected());
}

// After a timeout, the client can connect and send requests again.
TEST_F(GrootFaults, ASilentServerEndsInTime) {
  Connect(0.3);
  server_->BeSilentNext("get_action");
  EXPECT_THAT(Failure(), FailsAs(Kind::kTimeout, "no answer in 0.3 s"));
  EXPECT_FALSE(client_->connected());
  const int port = server_->port();
  server_.reset();
  GrootServer::Options options;
  options.port = port;
  server_ = std::make_unique<GrootServer>(options);
  ExpectActions(CallUntilInTime(client_.get(), Observation()));
}

// The request fails immediately, long before its deadline. When the server is back, requests succeed again.
TEST_F(GrootFaults, AServerThatIsGoneIsSeenAndFoundAgain) {
  ClientOptions options = To(*server_);
  options.connect_s = options.reply_s = options.first_reply_s = 1e6;
  client_ = MakeGrootClient(options);
  client_->Connect();
  server_->BeGoneNext("get_action");
  EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "the connection ended"));
  EXPECT_FALSE(client_->connected());
  EXPECT_THAT(FailureOf([&] { client_->Connect(); }), FailsAs(Kind::kUnreachable, "no server there"));
  const int port = server_->port();
  server_.reset();
  server_ = std::make_unique<GrootServer>(GrootServer::Options{Dialect::kN16Flat, 3, Form::kMap, "", port});
  client_->Connect();
  ExpectActions(client_->Infer(Observation()).value);
  EXPECT_EQ(client_->Name(), "GR00T N1.6 (flat)");
  // The server ends between two requests.
  server_.reset();
  EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "the connection ended"));
}

TEST_F(GrootFaults, ConnectingEndsInOneLineWhateverAnswers) {
  server_->AnswerNextWith("ping", EncodeGroot("pong"));
  EXPECT_THAT(FailureOf([&] { client_->Connect(); }), FailsAs(Kind::kServer, "ping with text \"pong\""));
  EXPECT_FALSE(client_->connected());
  server_->AnswerNextWith("get_modality_config", EncodeGroot(List{}));
  EXPECT_THAT(FailureOf([&] { client_->Connect(); }),
              FailsAs(Kind::kServer, "get_modality_config with list of 0"));
  server_->AnswerNextWith("get_modality_config", EncodeGroot(Map{{"video", "front"}}));
  EXPECT_THAT(FailureOf([&] { client_->Connect(); }),
              FailsAs(Kind::kReply, "video: expected a map with a list modality_keys, got text \"front\""));

  // A web server listens at this address.
  const doubles::RestServer web([](const std::string&) { return "{}"; });
  ClientOptions options;
  options.connect_s = 0.3;
  options.url = "tcp://127.0.0.1:" + std::to_string(web.port());
  const ServerError error = FailureOf([&] { MakeGrootClient(options)->Connect(); });
  EXPECT_TRUE(error.kind() == Kind::kProtocol || error.kind() == Kind::kTimeout) << error.what();
}

TEST(GrootClient, NeverStopsAServer) {
  for (const Dialect dialect : {Dialect::kN15, Dialect::kN16, Dialect::kN16Flat}) {
    const GrootServer server({dialect, 3, Form::kMap, "", 0});
    {
      const auto client = MakeGrootClient(To(server));
      client->Connect();
      client->BeginEpisode("lift the pot", 0);
      client->Infer(Observation());
      client->Connect();
    }
    const auto client = MakeGrootClient(To(server));
    client->Connect();
    for (const std::string& endpoint : Endpoints(server)) EXPECT_NE(endpoint, "kill");
  }
}

}  // namespace evalbus::policy::groot_client_test
