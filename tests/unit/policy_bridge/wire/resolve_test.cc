#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>

#include "policy_bridge/wire/url.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::resolve_test {

using Kind = ServerError::Kind;

const Url kUrl = ParseUrl("ws://robot.example:8000", "ws");

TEST(Resolve, FindsNumbersAndThisMachine) {
  EXPECT_EQ(Resolve(ParseUrl("ws://127.0.0.1:1", "ws"), 60), std::vector<std::string>{"127.0.0.1"});
  EXPECT_EQ(Resolve(ParseUrl("ws://[::1]:1", "ws"), 60), std::vector<std::string>{"::1"});
  const auto here = Resolve(ParseUrl("ws://localhost:1", "ws"), 60);
  EXPECT_NE(std::ranges::find(here, "127.0.0.1"), here.end());
}

TEST(IsLoopback, HoldsForAddressesOfThisMachine) {
  for (const char* url : {"ws://127.0.0.1:8000", "tcp://127.1.2.3:5555", "http://localhost:80/act",
                          "ws://[::1]:1", "ipc:///tmp/server"})
    EXPECT_TRUE(IsLoopback(url)) << url;
  for (const char* url : {"ws://10.0.0.7:8000", "tcp://gpu127.example:5555", "ws://[fd00::1]:1"})
    EXPECT_FALSE(IsLoopback(url)) << url;
}

TEST(Resolve, ReportsTheErrorOfTheLookup) {
  const auto fails = [](const std::string& host) -> std::vector<std::string> {
    throw std::runtime_error(host + "? unknown");
  };
  EXPECT_THAT(FailureOf([&] { Resolve(kUrl, 60, fails); }),
              FailsAs(Kind::kUnreachable,
                      "ws://robot.example:8000: the host cannot be resolved (robot.example? unknown)"));
}

// The name server does not answer. The lookup continues in the background, and its late result is discarded.
TEST(Resolve, KeepsItsDeadline) {
  struct Gate {
    std::mutex mutex;
    std::condition_variable changed;
    bool open = false, passed = false;
  };
  const auto gate = std::make_shared<Gate>();
  const auto late = [gate](const std::string&) {
    std::unique_lock lock(gate->mutex);
    gate->changed.wait(lock, [&] { return gate->open; });
    gate->passed = true;
    gate->changed.notify_all();
    return std::vector<std::string>{"127.0.0.1"};
  };
  EXPECT_THAT(FailureOf([&] { Resolve(kUrl, 0.05, late); }),
              FailsAs(Kind::kUnreachable, "no name server answered within 0.05 s"));
  std::unique_lock lock(gate->mutex);
  EXPECT_FALSE(gate->passed);
  gate->open = true;
  gate->changed.notify_all();
  gate->changed.wait(lock, [&] { return gate->passed; });
}

}  // namespace evalbus::policy::resolve_test
