#include <gtest/gtest.h>

#include "base/errors.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/codecs.h"
#include "tests/doubles/rest_server.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::rest_client_test {

using Kind = ServerError::Kind;
using doubles::HttpAnswer;
using doubles::RestServer;
using testing::HasSubstr;

// The float64 array [0.5, -1.0] in json_numpy's encoding, and its bytes (little-endian).
constexpr const char* kRow = R"({"__numpy__":"AAAAAAAA4D8AAAAAAADwvw==","dtype":"<f8","shape":[2]})";
const Bytes kRowBytes = FromHex("000000000000e03f000000000000f0bf");

// OpenVLA-OFT's keys are in the order that its model expects.
Value Observation() {
  return Map{{"full_image", Array{"|u1", {3}, {0, 1, 2}}},
             {"left_wrist_image", Array{"|u1", {3}, {0, 1, 2}}},
             {"a_right_wrist_image", Array{"|u1", {3}, {0, 1, 2}}},
             {"state", FloatArray({0.5}, {1})},
             {"instruction", "lift the pot"}};
}

class RestClient : public testing::Test {
 protected:
  RestClient() : server_(std::make_unique<RestServer>([this](const std::string&) { return answer_; })) {
    options_.wire = Wire::kRest;
    options_.url = server_->url();
    options_.max_reply_bytes = 10'000;
    client_ = MakePolicyClient(options_);
    client_->Connect();
  }
  // Sends a request that the server answers with this body. Returns the actions in the answer.
  Value Actions(const std::string& body) {
    answer_ = body;
    return *client_->Infer(Observation()).value.Find("actions");
  }
  ServerError Failure() {
    return FailureOf([&] { client_->Infer(Observation()); });
  }
  // Returns the error for an answer with status 200 and this body.
  ServerError FailureWith(const std::string& body) {
    client_->Connect();
    answer_ = body;
    return Failure();
  }

  std::string answer_ = kRow;
  std::unique_ptr<RestServer> server_;
  ClientOptions options_;
  std::unique_ptr<PolicyClient> client_;
};

TEST_F(RestClient, SendsAnObservationInItsOrder) {
  client_->Infer(Observation());
  ASSERT_EQ(server_->requests().size(), 1u);
  const RestServer::Request request = server_->requests()[0];
  EXPECT_EQ(request.line, "POST /act");
  EXPECT_EQ(request.content_type, "application/json");
  EXPECT_EQ(request.authorization, "");
  const std::string image = R"({"__numpy__":"AAEC","dtype":"|u1","shape":[3]})";
  EXPECT_EQ(request.body, R"({"full_image":)" + image + R"(,"left_wrist_image":)" + image +
                              R"(,"a_right_wrist_image":)" + image +
                              R"(,"state":{"__numpy__":"AAAAPw==","dtype":"<f4","shape":[1]},)"
                              R"("instruction":"lift the pot"})");
}

TEST_F(RestClient, UnderstandsAnArrayAListOfArraysAndEitherInAText) {
  const Value one = Array{"<f8", {1, 2}, kRowBytes};
  Bytes twice = kRowBytes;
  twice.insert(twice.end(), kRowBytes.begin(), kRowBytes.end());
  const Value two = Array{"<f8", {2, 2}, twice};
  const std::string rows = std::string("[") + kRow + "," + kRow + "]";
  EXPECT_EQ(Actions(kRow), one);
  EXPECT_EQ(Actions(std::string("[") + kRow + "]"), one);
  EXPECT_EQ(Actions(rows), two);
  EXPECT_EQ(Actions(EncodeJsonNumpy(kRow)), one);  // The JSON text is encoded as JSON again.
  EXPECT_EQ(Actions(EncodeJsonNumpy(rows)), two);
  EXPECT_EQ(Actions(EncodeJsonNumpy(two)), two);  // all rows in one array (H, D)
}

TEST_F(RestClient, NamesItsPathWithoutServerFacts) {
  EXPECT_EQ(client_->Connect(), Value(Map{}));
  EXPECT_TRUE(client_->connected());
  EXPECT_EQ(client_->Name(), "REST /act");
  client_->BeginEpisode("lift the pot", 0);
  EXPECT_EQ(server_->requests().size(), 0u);
}

TEST_F(RestClient, TakesUrlsOfItsScheme) {
  for (const char* url : {"", "https://127.0.0.1:8000/act", "http://127.0.0.1/act", "http://:8000/act",
                          "http://127.0.0.1:8000/a b", "http://u@127.0.0.1:8000/act"}) {
    options_.url = url;
    EXPECT_THROW(MakeRestClient(options_), InputError) << url;
  }
  for (const char* path : {"", "/"}) {
    options_.url = "http://localhost:8000" + std::string(path);
    EXPECT_EQ(MakeRestClient(options_)->Name(), "REST /act");
  }
  options_.url = "http://[::1]:8000/other?x=1";
  EXPECT_EQ(MakeRestClient(options_)->Name(), "REST /other?x=1");
}

TEST_F(RestClient, SendsAKeyWhereThereIsOne) {
  options_.api_key = "secret";
  client_ = MakeRestClient(options_);
  client_->Connect();
  client_->Infer(Observation());
  EXPECT_EQ(server_->requests().back().authorization, "Api-Key secret");
}

// The following tests concern faults.

TEST_F(RestClient, AServerThatReportsAnErrorMayBeCalledAgain) {
  EXPECT_THAT(FailureWith("\"error\""), FailsAs(Kind::kServer, "the server reports: error"));
  EXPECT_THAT(FailureWith(R"("\"error\"")"), FailsAs(Kind::kServer, "the server reports: error"));
  EXPECT_THAT(FailureWith(R"({"error": "no unnorm_key"})"),
              FailsAs(Kind::kServer, "the server reports: no unnorm_key"));
  server_->AnswerNextWith(
      HttpAnswer("500 Internal Server Error", "Traceback\n  File x\nKeyError: 'full_image'\n"));
  const ServerError error = Failure();
  EXPECT_THAT(error, FailsAs(Kind::kServer, "HTTP status 500: the server reports: KeyError: 'full_image'"));
  EXPECT_THAT(error.details(), HasSubstr("Traceback"));
  server_->AnswerNextWith(HttpAnswer("404 Not Found", ""));
  EXPECT_THAT(Failure(), FailsAs(Kind::kServer, "HTTP status 404"));
  EXPECT_TRUE(client_->connected());
  answer_ = kRow;
  EXPECT_NO_THROW(client_->Infer(Observation()));
}

TEST_F(RestClient, AnswersOfAnotherFormCloseIt) {
  for (const char* body :
       {"{}", "[]", "null", "1.5", "[1.5]", R"({"__numpy__":"AAAAPw==","dtype":"<f4","shape":[]})",
        R"({"__numpy__":"AAAAPw==","dtype":"<f4","shape":[1,1,1]})"}) {
    EXPECT_THAT(FailureWith(body), FailsAs(Kind::kReply, "actions")) << body;
    EXPECT_FALSE(client_->connected());
  }
  const std::string other = R"({"__numpy__":"AAAAPw==","dtype":"<f4","shape":[1]})";
  EXPECT_THAT(FailureWith(std::string("[") + kRow + "," + other + "]"),
              FailsAs(Kind::kReply, "array <f4 [1]"));
  EXPECT_THAT(FailureWith("[" + other + "," + kRow + "]"), FailsAs(Kind::kReply, "array <f8 [2]"));
  EXPECT_THAT(FailureWith("[" + other + R"(,{"__numpy__":"AAAAPwAAAAA=","dtype":"<f4","shape":[2]}])"),
              FailsAs(Kind::kReply, "array <f4 [2]"));
}

TEST_F(RestClient, BytesOfNoAnswerCloseIt) {
  EXPECT_THAT(FailureWith("<html>"), FailsAs(Kind::kProtocol, "JSON"));
  EXPECT_THAT(FailureWith(R"({"__numpy__":"AAEC","dtype":"|u1","shape":[4]})"),
              FailsAs(Kind::kProtocol, "[4]"));
  for (const char* bytes : {"no HTTP at all\r\n\r\n", "HTTP/1.1 200 OK\r\nContent-Le",
                            "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n{\"__num",
                            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n{\"_"}) {
    client_->Connect();
    server_->AnswerNextWith(bytes);
    EXPECT_THAT(Failure(), FailsAs(Kind::kProtocol, "incomplete or malformed HTTP answer")) << bytes;
    EXPECT_FALSE(client_->connected());
    EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "not connected"));
  }
}

TEST_F(RestClient, AnAnswerThatIsTooLongIsNotRead) {
  // The answer announces 2 GB but does not send them.
  server_->AnswerNextWith("HTTP/1.1 200 OK\r\nContent-Length: 2147483648\r\n\r\n");
  EXPECT_THAT(Failure(), FailsAs(Kind::kProtocol, "more than 10000 bytes"));
  EXPECT_THAT(FailureWith('"' + std::string(10'000, ' ') + '"'),
              FailsAs(Kind::kProtocol, "more than 10000 bytes"));
  client_->Connect();
  server_->AnswerNextWith("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n7fffffff\r\n" +
                          std::string(20'000, ' '));
  EXPECT_THAT(Failure(), FailsAs(Kind::kProtocol, "more than 10000 bytes"));
}

TEST_F(RestClient, ASilentServerEndsInTime) {
  options_.first_reply_s = 0.2;
  client_ = MakeRestClient(options_);
  client_->Connect();
  server_->BeSilentNext();
  EXPECT_THAT(Failure(), FailsAs(Kind::kTimeout, "no answer in 0.2 s"));
  EXPECT_FALSE(client_->connected());
}

TEST_F(RestClient, AServerThatIsGoneIsSeenAndFoundAgain) {
  options_.connect_s = options_.reply_s = options_.first_reply_s = 1e6;
  client_ = MakeRestClient(options_);
  client_->Connect();
  server_->AnswerNextWith("");
  EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "the connection ended without a complete answer"));
  EXPECT_FALSE(client_->connected());
  const int port = server_->port();
  server_.reset();
  EXPECT_THAT(FailureOf([&] { client_->Connect(); }), FailsAs(Kind::kUnreachable, "refused"));
  server_ = std::make_unique<RestServer>([](const std::string&) { return kRow; }, port);
  client_->Connect();
  EXPECT_NO_THROW(client_->Infer(Observation()));
  server_.reset();
  EXPECT_THAT(Failure(), FailsAs(Kind::kUnreachable, "refused"));
}

TEST_F(RestClient, ALargeRequestAndALargeAnswerAreWhole) {
  options_.max_reply_bytes = 64 << 20;
  client_ = MakeRestClient(options_);
  client_->Connect();
  const Value large = Array{"<f8", {1, 1 << 20}, Bytes(8 << 20, 63)};
  answer_ = EncodeJsonNumpy(large);
  const Reply reply = client_->Infer(Map{{"image", large}});
  EXPECT_EQ(*reply.value.Find("actions"), large);
  EXPECT_EQ(server_->requests().back().body, "{\"image\":" + answer_ + "}");
}

// Servers and proxies that decide about a large request before they read it send such answers.
TEST_F(RestClient, ReadsTheAnswerBehindInterimOnes) {
  const std::string interim = "HTTP/1.1 100 Continue\r\n\r\n",
                    early = "HTTP/1.1 103 Early Hints\r\nLink: x\r\n\r\n";
  server_->AnswerNextWith(interim + early + interim + HttpAnswer("200 OK", kRow));
  EXPECT_EQ(*client_->Infer(Observation()).value.Find("actions"), Value(Array{"<f8", {1, 2}, kRowBytes}));
  std::string endless;
  for (int i = 0; i < 100; ++i) endless += interim;
  server_->AnswerNextWith(endless + HttpAnswer("200 OK", kRow));
  EXPECT_THAT(Failure(), FailsAs(Kind::kProtocol, "interim"));
}

}  // namespace evalbus::policy::rest_client_test
