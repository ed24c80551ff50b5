#include "policy_bridge/wire/policy_pool.h"

#include <gtest/gtest.h>

#include <future>
#include <limits>

#include "base/errors.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/zeromq.h"
#include "tests/doubles/groot_server.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::policy_pool_test {

using Dialect = ClientOptions::GrootDialect;
using Kind = ServerError::Kind;
using doubles::GrootServer;

// Maximum batch delay of tests that complete their batches themselves.
constexpr std::chrono::milliseconds kForever = std::chrono::hours(1);

Value Observation(double arm, const std::string& task = "lift", int64_t length = 2) {
  std::vector<double> joints(static_cast<size_t>(length), arm);
  return Map{{"video.front", Array{"|u1", {1, 1, 1, 3}, {1, 2, static_cast<uint8_t>(arm)}}},
             {"state.arm", FloatArray(joints, {1, length})},
             {"state.gripper", FloatArray({0.25}, {1, 1})},
             {"annotation.human.task_description", task}};
}

// Returns the test server's actions for Observation(arm).
Value Actions(double arm, int64_t length = 2) {
  std::vector<double> arms;
  for (int i = 0; i < 3; ++i) arms.insert(arms.end(), static_cast<size_t>(length), arm + i);
  return Map{{"arm", FloatArray(arms, {3, length})}, {"gripper", FloatArray({0, 1, 2}, {3, 1})}};
}

class Pool : public testing::Test {
 protected:
  void Serve(const GrootServer::Options& options = {}) { server_ = std::make_unique<GrootServer>(options); }
  void Open(int batch_size, int num_clients, std::chrono::milliseconds gather = kForever) {
    options_.wire = Wire::kGroot;
    options_.url = server_->url();
    pool_.emplace(options_, batch_size, gather);
    options_.pool_url = pool_->url();
    for (int i = 0; i < num_clients; ++i) {
      clients_.push_back(MakePolicyClient(options_));
      clients_.back()->Connect();
    }
  }
  // Sends all requests at the same time.
  std::vector<std::future<Reply>> Call(const std::vector<Value>& observations) {
    std::vector<std::future<Reply>> replies;
    for (size_t i = 0; i < observations.size(); ++i) {
      replies.push_back(
          std::async(std::launch::async, [&, i] { return clients_[i]->Infer(observations[i]); }));
    }
    for (auto& reply : replies) reply.wait();
    return replies;
  }

  std::unique_ptr<GrootServer> server_;
  ClientOptions options_;
  std::optional<PolicyPool> pool_;
  std::vector<std::unique_ptr<PolicyClient>> clients_;
};

class PoolOfDialect : public Pool, public testing::WithParamInterface<Dialect> {};

TEST_P(PoolOfDialect, BatchesWaitingCalls) {
  GrootServer::Options server;
  server.dialect = GetParam();
  Serve(server);
  Open(8, 3);
  auto replies = Call({Observation(1), Observation(2, "turn"), Observation(3)});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(replies[static_cast<size_t>(i)].get().value, Actions(i + 1)) << i;
  EXPECT_EQ(server_->batches(), std::vector{3});
  // The pool is one client of the server, whichever worker calls it.
  int connected = 0;
  for (const Value& request : server_->requests()) {
    connected += *request.Find("endpoint") == Value("get_modality_config");
    EXPECT_FALSE(*request.Find("endpoint") == Value("reset"));
  }
  EXPECT_EQ(connected, 1);
}

INSTANTIATE_TEST_SUITE_P(All, PoolOfDialect,
                         testing::Values(Dialect::kN15, Dialect::kN16, Dialect::kN16Flat));

TEST_F(Pool, BatchesNoMoreThanTheContractAllows) {
  Serve();
  Open(2, 3, PolicyPool::kGather);
  auto replies = Call({Observation(1), Observation(2), Observation(3)});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(replies[static_cast<size_t>(i)].get().value, Actions(i + 1)) << i;
  for (const int size : server_->batches()) EXPECT_LE(size, 2);
}

TEST_F(Pool, DoesNotWaitForIdleWorkers) {
  Serve();
  Open(8, 3, PolicyPool::kGather);
  EXPECT_EQ(clients_[1]->Infer(Observation(1)).value, Actions(1));
}

TEST_F(Pool, CallsSeparatelyForOtherShapes) {
  Serve();
  Open(8, 2);
  auto replies = Call({Observation(1), Observation(2, "lift", 7)});
  EXPECT_EQ(replies[0].get().value, Actions(1));
  EXPECT_EQ(replies[1].get().value, Actions(2, 7));
  EXPECT_EQ(server_->batches(), (std::vector{1, 1}));
}

// Results do not depend on other requests that are made at the same time.
TEST_F(Pool, PassesAServersErrorToItsCaller) {
  Serve();
  Open(8, 3);
  auto replies =
      Call({Observation(1), Observation(std::numeric_limits<double>::quiet_NaN()), Observation(3)});
  EXPECT_EQ(replies[0].get().value, Actions(1));
  EXPECT_THAT(FailureOf([&] { replies[1].get(); }), FailsAs(Kind::kServer, "Observation is not finite"));
  EXPECT_EQ(replies[2].get().value, Actions(3));
}

TEST_F(Pool, ASilentServerConcernsTheBatchAlone) {
  Serve();
  options_.first_reply_s = 0.3;
  Open(2, 3, PolicyPool::kGather);
  server_->BeSilentNext("get_action");
  auto replies = Call({Observation(1)});
  EXPECT_THAT(FailureOf([&] { replies[0].get(); }), FailsAs(Kind::kTimeout, "no answer in 0.3 s"));
  EXPECT_FALSE(clients_[0]->connected());
  // The server is unreachable first and then returns.
  const int port = server_->port();
  server_.reset();
  EXPECT_THAT(FailureOf([&] { clients_[0]->Connect(); }), FailsAs(Kind::kUnreachable, "no server there"));
  GrootServer::Options again;
  again.port = port;
  Serve(again);
  EXPECT_EQ(CallUntilInTime(clients_[1].get(), Observation(2)), Actions(2));
  EXPECT_TRUE(clients_[1]->connected());
  EXPECT_EQ(CallUntilInTime(clients_[0].get(), Observation(1)), Actions(1));
}

TEST_F(Pool, PassesOnThatAnObservationIsWrong) {
  Serve();
  Open(2, 1);
  EXPECT_THROW(clients_[0]->Infer(Map{{"state.arm", FloatArray({1, 2}, {2})}}), InputError);
  EXPECT_EQ(clients_[0]->Infer(Observation(1)).value, Actions(1));
}

TEST_F(Pool, SurvivesBytesOfNoRequest) {
  Serve();
  Open(2, 1);
  RequestSocket socket(pool_->url(), 10, 1 << 20);
  const Value answer = DecodeMsgpack(socket.Call({0xc1, 0xff}, 10));
  EXPECT_TRUE(answer.Find("error")) << Describe(answer);
  EXPECT_EQ(clients_[0]->Infer(Observation(1)).value, Actions(1));
}

TEST_F(Pool, ThatIsGoneIsSeen) {
  Serve();
  Open(2, 1);
  server_->BeSilentNext("get_action");
  auto reply = std::async(std::launch::async, [&] { return clients_[0]->Infer(Observation(1)); });
  while (server_->requests().size() < 3) std::this_thread::yield();
  pool_.reset();
  server_.reset();
  EXPECT_EQ(FailureOf([&] { reply.get(); }).kind(), Kind::kUnreachable);
}

}  // namespace evalbus::policy::policy_pool_test
