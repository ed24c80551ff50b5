// Tests the web server over loopback: which clients have access, what it answers, and how it handles
// misbehaving clients.
#include "viz/web/server.h"

#include <gmock/gmock.h>

#include <future>
#include <optional>

#include "base/errors.h"
#include "tests/deadline.h"
#include "tests/unit/viz/web/web_client.h"

namespace evalbus::viz::server_test {

using testing::HasSubstr;
using testing::Not;

class Server : public testing::Test {
 protected:
  void Begin(const WebServer::Limits& limits = {}, const std::string& host = "") {
    broadcaster_ = std::make_shared<UpdateBroadcaster>();
    server_.emplace(WebServer::Address{host, 0}, broadcaster_, limits);
    server_->Start([this](const WebTarget& target, WebServer::Reply reply) {
      if (target.kind == WebTarget::Kind::kEpisode) return Later(std::move(reply));
      WebAnswer answer;
      answer.type = "text/html";
      answer.body =
          target.name == "large" ? large_ : std::make_shared<const std::string>("file " + target.name);
      answer.is_forever = target.kind == WebTarget::Kind::kBlock;
      reply(answer);
    });
    port_ = server_->port();
  }
  void Later(WebServer::Reply reply) {
    std::thread([moved = std::move(reply)] { moved(WebAnswer::Text(200, "an episode")); }).join();
  }
  std::string Origin() const { return "http://localhost:" + std::to_string(port_); }

  const SharedBytes large_ = std::make_shared<const std::string>(4 << 20, 'x');
  std::shared_ptr<UpdateBroadcaster> broadcaster_;
  std::optional<WebServer> server_;
  uint16_t port_ = 0;
};

TEST_F(Server, AnswersWithHeadersThatKeepOthersOut) {
  Begin();
  const std::string page = Get(port_, "/");
  EXPECT_EQ(StatusOf(page), 200);
  EXPECT_EQ(BodyOf(page), "file ");
  for (const char* header :
       {"Content-Security-Policy: default-src 'none'; script-src 'self'", "X-Content-Type-Options: nosniff",
        "X-Frame-Options: DENY", "Cross-Origin-Resource-Policy: same-origin", "Referrer-Policy: no-referrer",
        "Cache-Control: no-store"}) {
    EXPECT_THAT(page, HasSubstr(header));
  }
  EXPECT_THAT(page, Not(HasSubstr("Access-Control")));
  EXPECT_EQ(BodyOf(Get(port_, "/page/scene.js")), "file scene.js");
  EXPECT_THAT(Get(port_, "/block/" + std::string(64, 'a')), HasSubstr("immutable"));
  EXPECT_EQ(BodyOf(Get(port_, "/episode/0/1")), "an episode\n");
  EXPECT_EQ(server_->url(), "http://127.0.0.1:" + std::to_string(port_) + "/");
}

TEST_F(Server, HeadIsGetWithoutABody) {
  Begin();
  const std::string answer = Get(port_, "/page/a.js", "localhost", "", "HEAD");
  EXPECT_EQ(StatusOf(answer), 200);
  EXPECT_THAT(answer, HasSubstr("Content-Length: 9\r\n"));
  EXPECT_EQ(BodyOf(answer), "");
}

TEST_F(Server, WhatIsNotThereIsNotThere) {
  Begin();
  for (const char* target :
       {"/page/../../etc/passwd", "/page/", "/etc/passwd", "//", "/page/%2e%2e/x", "/live/x"}) {
    EXPECT_EQ(StatusOf(Get(port_, target)), 404) << target;
  }
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE"}) {
    EXPECT_EQ(StatusOf(Get(port_, "/", "localhost", "", method)), 405) << method;
  }
}

TEST_F(Server, AnotherNameIsRefused) {
  Begin();
  EXPECT_EQ(StatusOf(Get(port_, "/", "evil.example")), 403);
  EXPECT_EQ(StatusOf(Get(port_, "/block/" + std::string(64, 'a'), "evil.example:" + std::to_string(port_))),
            403);
  EXPECT_EQ(StatusOf(AnswerTo(port_, "GET / HTTP/1.1\r\nConnection: close\r\n\r\n")), 400);
  EXPECT_EQ(StatusOf(Get(port_, "/", "localhost", "Host: evil.example\r\n")), 400);
}

TEST_F(Server, OnlyAPageOfOursListens) {
  Begin();
  broadcaster_->SetRun(0, "the run");
  WebClient own(port_, Origin());
  EXPECT_FALSE(own.error()) << own.error().message();
  EXPECT_EQ(own.Read(), "the run");
  for (const std::string origin :
       {"http://evil.example", "null", "https://localhost", "http://localhost:1"}) {
    WebClient other(port_, origin);
    EXPECT_TRUE(other.error()) << origin;
    EXPECT_EQ(other.status(), 403) << origin;
  }
  EXPECT_EQ(StatusOf(Get(port_, "/live")), 426);
}

TEST_F(Server, ElsewhereATokenIsNeeded) {
  try {
    Begin({}, "0.0.0.0");
  } catch (const InputError& error) {
    GTEST_SKIP() << error.what();
  }
  const std::string token = server_->token();
  EXPECT_EQ(token.size(), 32u);
  EXPECT_EQ(StatusOf(Get(port_, "/" + token + "/", "robot.lab")), 200);
  for (const std::string& target :
       std::vector<std::string>{"/", "/page/a.js", "/live", "/x" + token + "/", "/" + token}) {
    EXPECT_EQ(StatusOf(Get(port_, target, "robot.lab")), 404) << target;
  }
  broadcaster_->SetRun(0, "the run");
  WebClient without(port_, Origin());
  EXPECT_EQ(without.status(), 404);
  WebClient with(port_, Origin(), "/" + token + "/live");
  EXPECT_EQ(with.Read(), "the run");
  EXPECT_EQ(WebClient(port_, "http://evil.example", "/" + token + "/live").status(), 403);
  // Each server has its own token.
  EXPECT_NE(WebServer({"0.0.0.0", 0}, broadcaster_).token(), token);
}

TEST_F(Server, BadRequestsAreRefusedInWords) {
  Begin();
  EXPECT_EQ(StatusOf(AnswerTo(port_, "what is this\r\n\r\n")), 400);
  EXPECT_EQ(StatusOf(AnswerTo(port_, "GET / HTTP/9.9\r\n\r\n")), 400);
  EXPECT_EQ(StatusOf(AnswerTo(port_, std::string("GET /\0 HTTP/1.1\r\n\r\n", 18))), 400);
  EXPECT_EQ(StatusOf(AnswerTo(port_, "GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\n12345")),
            413);
  // The header is too long. A client that continues to send is disconnected, perhaps before the answer
  // arrives.
  const int status = StatusOf(Get(port_, "/", "localhost", "X: " + std::string(20'000, 'x') + "\r\n"));
  EXPECT_TRUE(status == 431 || status == 0) << status;
  // The server still answers.
  EXPECT_EQ(StatusOf(Get(port_, "/")), 200);
}

TEST_F(Server, SeveralRequestsOnAConnectionAndNotTooMany) {
  WebServer::Limits limits;
  limits.requests = 3;
  limits.requests_per_s = 1;
  Begin(limits);
  std::string requests;
  for (int i = 0; i < 50; ++i) requests += "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const std::string answer = AnswerTo(port_, requests);
  EXPECT_EQ(StatusOf(answer), 200);
  EXPECT_THAT(answer, HasSubstr("HTTP/1.1 429 "));
}

TEST_F(Server, APageThatSendsAnythingElseIsDisconnected) {
  Begin();
  for (const std::string& text :
       std::vector<std::string>{std::string("{}"), std::string("{\"watch\": \"0\"}"), std::string("\xff\xfe"),
                                std::string(5000, 'x'), std::string(300, '[')}) {
    WebClient client(port_, Origin());
    client.Publish(text);
    client.Read();
    EXPECT_TRUE(client.error()) << text.substr(0, 20);
  }
  // A client that repeats a message is also disconnected.
  WebClient chatty(port_, Origin());
  for (int i = 0; i < 1000 && !chatty.error(); ++i) chatty.Publish("{\"watch\": 0}");
  while (!chatty.error()) chatty.Read();
  EXPECT_TRUE(chatty.error());
}

constexpr char kNote[] = R"({"note": {"run": 0, "episode": 3, "text": "odd"}})";

TEST(WebServer, HandsOverNotesOfItsOwnPageOnly) {
  WebServer server(WebServer::Address{}, std::make_shared<UpdateBroadcaster>());
  EXPECT_TRUE(server.is_loopback());
  std::promise<WebNote> received;
  server.Start([](const WebTarget&, const WebServer::Reply&) {},
               [&](WebNote note) { received.set_value(std::move(note)); });
  const std::string own = "http://localhost:" + std::to_string(server.port());
  WebClient foreign(server.port(), "http://elsewhere");
  EXPECT_EQ(foreign.status(), 403);
  WebClient client(server.port(), own);
  client.Publish(kNote);
  std::future<WebNote> note = received.get_future();
  ASSERT_EQ(note.wait_for(kDeadline), std::future_status::ready);
  EXPECT_EQ(note.get().text, "odd");
}

TEST_F(Server, DisconnectsAPageThatSendsWhatItDoesNotTake) {
  Begin();
  for (const char* text :
       {kNote, R"({"verdict": {"episode": 0, "outcome": "success", "stages": null, "rubric": null}})"}) {
    WebClient client(port_, Origin());
    client.Publish(text);
    client.Read();
    EXPECT_TRUE(client.error()) << text;
  }
}

TEST_F(Server, TheRunThatIsWatchedIsTheOneThatComes) {
  Begin();
  broadcaster_->SetRun(1, "run 1");
  broadcaster_->SetEpisode(0, "episode of 0", true);
  broadcaster_->SetEpisode(1, "episode of 1", true);
  WebClient client(port_, Origin());
  EXPECT_EQ(client.Read(), "run 1");
  EXPECT_EQ(client.Read(), "episode of 0");
  client.Publish("{\"watch\": 1}");
  EXPECT_EQ(client.Read(), "episode of 1");
  // For an unknown run nothing is sent, and the viewer continues to receive the previous one.
  client.Publish("{\"watch\": 7}");
  broadcaster_->AddTicks(1, "ticks of 1");
  server_->Wake();
  EXPECT_EQ(client.Read(), "ticks of 1");
}

// One of fifty viewers never reads. The others receive every block, and the server does not keep every block
// for the silent viewer.
TEST_F(Server, AClientThatNeverReadsDelaysNoOther) {
  Begin();
  broadcaster_->SetEpisode(0, "episode", true);
  std::vector<std::unique_ptr<WebClient>> viewers;
  for (int i = 0; i < 49; ++i) {
    viewers.push_back(std::make_unique<WebClient>(port_, Origin()));
    EXPECT_EQ(viewers.back()->Read(), "episode");
  }
  WebClient silent(port_, Origin(), "/live", true);
  ASSERT_FALSE(silent.error());
  // The blocks exceed all buffers between the server and a client.
  constexpr int kBlocks = 200;
  const std::string large(100'000, 'x');
  for (int i = 0; i < kBlocks; ++i) {
    broadcaster_->AddTicks(0, std::to_string(i) + large);
    server_->Wake();
    for (auto& viewer : viewers) {
      ASSERT_EQ(viewer->Read().substr(0, 5), (std::to_string(i) + large).substr(0, 5))
          << viewer->error().message();
    }
  }
  EXPECT_EQ(broadcaster_->num_viewers(), 50);
  // When the silent client finally reads, it receives the data in transit and then the current state of the
  // episode.
  broadcaster_->SetEpisode(0, "episode now", false);
  broadcaster_->AddTicks(0, "ticks now");
  server_->Wake();
  EXPECT_EQ(silent.Read(), "episode");
  int late = 0;
  std::string block;
  for (; (block = silent.Read()) != "episode now" && !silent.error(); ++late) {
  }
  EXPECT_EQ(block, "episode now");
  EXPECT_EQ(silent.Read(), "ticks now");
  EXPECT_LT(late, kBlocks - static_cast<int>(UpdateBroadcaster::kKeptTickBytes / large.size()));
}

TEST_F(Server, TooManyViewersAreRefused) {
  WebServer::Limits limits;
  limits.viewers = 2;
  Begin(limits);
  WebClient a(port_, Origin()), b(port_, Origin()), c(port_, Origin());
  EXPECT_FALSE(a.error());
  EXPECT_FALSE(b.error());
  EXPECT_EQ(c.status(), 503);
}

TEST_F(Server, AFirstRequestHasLessTimeThanLaterOnes) {
  WebServer::Limits limits;
  limits.first_request = std::chrono::seconds(1);
  limits.timeout = std::chrono::hours(1);
  Begin(limits);
  // The server closes the connection after half a request. Otherwise the call would end at kDeadline without
  // an answer.
  EXPECT_EQ(AnswerTo(port_, "GET / HTTP/1.1\r\nHost: loc"), "");
  limits.first_request = std::chrono::hours(1);
  limits.timeout = std::chrono::seconds(1);
  Begin(limits);
  EXPECT_EQ(StatusOf(AnswerTo(port_, "GET / HTTP/1.1\r\nHost: localhost\r\n\r\nGET / HTTP/1.1\r\nHost: loc")),
            200);
}

// No request is ever completed on many connections.
TEST_F(Server, ManyHalfRequestsLockNoClientOut) {
  WebServer::Limits limits;
  limits.connections = 4;
  Begin(limits);
  HalfRequests half(port_);
  for (int i = 0; i < 20; ++i) {
    half.Add();
    EXPECT_EQ(StatusOf(Get(port_, "/")), 200) << i;
  }
  // A viewer may send nothing.
  broadcaster_->SetRun(0, "the run");
  WebClient viewer(port_, Origin());
  EXPECT_EQ(viewer.Read(), "the run");
  for (int i = 0; i < 20; ++i) half.Add();
  broadcaster_->SetRun(0, "the run later");
  server_->Wake();
  EXPECT_EQ(viewer.Read(), "the run later");
}

// The whole transfer takes several times as long as a client may read nothing.
TEST_F(Server, AnAnswerMayTakeLongWhileItIsBeingTaken) {
  WebServer::Limits limits;
  limits.timeout = std::chrono::seconds(2);
  Begin(limits);
  EXPECT_EQ(BodyOf(GetSlowly(port_, "/page/large", std::chrono::milliseconds(60), 40'000)).size(),
            large_->size());
}

TEST_F(Server, AViewerThatLeavesIsForgotten) {
  Begin();
  broadcaster_->SetRun(0, "run");
  {
    WebClient client(port_, Origin());
    EXPECT_EQ(client.Read(), "run");
    EXPECT_EQ(broadcaster_->num_viewers(), 1);
  }
  // The client's last message may still be in transit.
  const auto give_up = std::chrono::steady_clock::now() + kDeadline;
  while (broadcaster_->num_viewers() > 0 && std::chrono::steady_clock::now() < give_up) Get(port_, "/");
  EXPECT_EQ(broadcaster_->num_viewers(), 0);
}

TEST_F(Server, KnowsWhetherOtherMachinesReachIt) {
  Begin({}, "0.0.0.0");
  EXPECT_FALSE(server_->is_loopback());
}

TEST_F(Server, AnyAddressOfTheUsersChoiceHasAToken) {
  for (const char* host : {"127.0.0.1", "127.0.0.2"}) {
    Begin({}, host);
    ASSERT_EQ(server_->token().size(), 32u) << host;
    const std::string url = server_->url(), address = std::string(host) + ":" + std::to_string(port_);
    ASSERT_EQ(url, "http://" + address + "/" + server_->token() + "/");
    EXPECT_EQ(StatusOf(Get(port_, "/" + server_->token() + "/", address, "", "GET", host)), 200) << host;
    EXPECT_EQ(StatusOf(Get(port_, "/", address, "", "GET", host)), 404) << host;
  }
}

TEST(WebServer, APortInUseIsReported) {
  const auto broadcaster = std::make_shared<UpdateBroadcaster>();
  const WebServer first({"127.0.0.1", 0}, broadcaster);
  EXPECT_THROW(WebServer({"127.0.0.1", first.port()}, broadcaster), InputError);
  EXPECT_THROW(WebServer({"no such host.example", 0}, broadcaster), InputError);
}

TEST(WebServer, ListensOnASocketThatItInherits) {
  const auto broadcaster = std::make_shared<UpdateBroadcaster>();
  auto first = std::make_unique<WebServer>(WebServer::Address{"127.0.0.1", 0}, broadcaster);
  WebServer second(dup(first->descriptor()), broadcaster);
  const uint16_t port = first->port();
  first.reset();
  second.Start([](const WebTarget&, WebServer::Reply reply) { reply(WebAnswer::Text(200, "here")); });
  EXPECT_EQ(second.port(), port);
  EXPECT_EQ(BodyOf(Get(port, "/")), "here\n");
}

}  // namespace evalbus::viz::server_test
