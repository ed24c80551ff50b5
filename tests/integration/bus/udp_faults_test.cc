// Tests the real processes of a run on a real network with faults. The run either has the results of an
// undisturbed run or ends with one line that states the reason.
#include <arpa/inet.h>
#include <dlfcn.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <random>

#include "bus/channels.h"
#include "evalbus/component_status_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::udp_faults_test {

namespace fs = std::filesystem;

// For Program::Setting: preloads the network's library before the program's own libraries and after a
// sanitizer's, which must be first.
std::function<void()> On(const std::string& network) {
  std::string libraries = BAD_NETWORK_LIBRARY;
  for (const char* name : {"__asan_init", "__tsan_init"}) {
    Dl_info sanitizer{};
    void* const function = dlsym(RTLD_DEFAULT, name);
    if (function != nullptr && dladdr(function, &sanitizer) != 0) {
      libraries = std::string(sanitizer.dli_fname) + ":" + libraries;
    }
  }
  return [=] {
    if (network.empty()) return;
    setenv("LD_PRELOAD", libraries.c_str(), 1);
    setenv("BAD_NETWORK", network.c_str(), 1);
  };
}

class UdpFaults : public testing::Test {
 protected:
  void SetUp() override {
    EVALBUS_NEEDS_BUS();
    ASSERT_EQ(RunProgram(Command(reference_, {"--in-process"})).code, 0);
    bus_.emplace(url_);
    bus_->Subscribe(channels::kStatus, [this](const component_status_t& status) {
      foreign_messages_[status.component] =
          std::max(foreign_messages_[status.component], status.foreign_messages);
      decode_errors_[status.component] = std::max(decode_errors_[status.component], status.decode_errors);
    });
    bus_->SubscribeRaw(channels::kState.name,
                       [this](std::string_view, std::span<const uint8_t> data, int64_t) {
                         const std::vector<uint8_t> bytes(data.begin(), data.end());
                         repeated_states_ += bytes == state_;
                         state_ = bytes;
                       });
  }

  std::vector<std::string> Command(const fs::path& out, const std::vector<std::string>& more) const {
    std::vector<std::string> command = {"evalbus", "run",        task_,        "--policy", "noisy_expert",
                                        "--out",   out.string(), "--episodes", "2"};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }

  // Runs the program to its end on the test's bus, on a network with this fault, and receives every message.
  Result Run(const std::string& network, const std::vector<std::string>& more = {},
             const std::string& url_options = "") {
    std::vector<std::string> arguments = {"--url", url_ + url_options};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Program launcher(Command(run_, arguments), {{}, On(network)});
    const auto ends = [&] {
      while (bus_->Handle()) {
      }
      if (beside_) beside_(launcher.pid());
      return !launcher.running();
    };
    EXPECT_TRUE(WaitFor(ends)) << launcher.out();
    return {launcher.Wait(), launcher.out(), launcher.err()};
  }

  // Expects either the reference's scores, or exit code 2 with one line and no scores that differ.
  void ExpectTheSameOrAReason(const Result& result) {
    if (result.code == 0) {
      EXPECT_EQ(result.err, "");
      return ExpectSameScores(run_, reference_);
    }
    EXPECT_EQ(result.code, 2) << result.out << result.err;
    EXPECT_TRUE(result.err.starts_with("error: ")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(ReadText(reference_ / "episodes.jsonl").starts_with(ReadText(run_ / "episodes.jsonl")));
  }

  TemporaryFolder folder_;
  const std::string task_ = ShortTask(folder_.path(), 1);
  const fs::path reference_ = folder_.path() / "reference", run_ = folder_.path() / "run";
  const std::string url_ = UniqueUrl();
  std::optional<Bus> bus_;
  // Called repeatedly while a run is active.
  std::function<void(pid_t launcher)> beside_;
  // Highest counts that each component reported.
  std::map<std::string, int64_t> foreign_messages_, decode_errors_;
  std::vector<uint8_t> state_;
  int repeated_states_ = 0;
};

TEST_F(UdpFaults, RepeatedMessagesChangeNothing) {
  const Result result = Run("repeat 2");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("retrying"), std::string::npos) << result.out;
  ExpectSameScores(run_, reference_);
  for (const char* name : {"sim", "collision", "metrics", "policy"})
    EXPECT_GT(foreign_messages_[name], 10) << name;
  ExpectLogged(run_, "metrics", "info", "that were repeated or belong to another episode");
}

TEST_F(UdpFaults, WorkersReportWhatTheyDropped) {
  Program launcher(Command(run_, {"--workers", "2"}), {{}, On("repeat 2")});
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  const std::string& out = launcher.out();
  const std::string dropped = "\nmessages ignored by collision, metrics";
  const size_t first = out.find(dropped);
  ASSERT_NE(first, std::string::npos) << out;
  EXPECT_NE(out.find(dropped, first + 1), std::string::npos) << out;
}

TEST_F(UdpFaults, ReorderedMessagesChangeNothing) {
  const Result result = Run("reorder 4");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("retrying"), std::string::npos) << result.out;
  ExpectSameScores(run_, reference_);
}

TEST_F(UdpFaults, LostMessagesAreRepeated) {
  ExpectTheSameOrAReason(Run("lose 150"));
  // The sim resends a STATE that was not answered.
  EXPECT_GT(repeated_states_, 0);
  if (fs::exists(run_)) ExpectLogged(run_, "sim", "", ": resending STATE");
}

// The run does not wait for the recorder at every tick. An episode is retried if its log is incomplete. If
// all attempts have incomplete logs, the run reports it.
TEST_F(UdpFaults, TicksThatTheRecorderLosesAreReported) {
  const Result result = Run("lose 20 evalbus-recorder");
  EXPECT_EQ(result.code, 0) << result.err;
  ExpectSameScores(run_, reference_);
  EXPECT_NE(result.out.find("      0  retrying: the log lacks "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("recorder  e0 attempt 3"), std::string::npos) << result.out;
  ExpectLogged(run_, "recorder", "warning", "lost on the way to the recorder");
}

TEST_F(UdpFaults, WhatIsLostInRealtimeIsCountedAndMakesAnEpisodeIncomplete) {
  const Result result = Run("lose 25", {"--realtime"});
  // Every lost message that the run needs is resent, or the episode is retried. After three attempts the run
  // fails.
  if (result.code != 0) {
    EXPECT_EQ(result.code, 2);
    EXPECT_TRUE(result.err.starts_with("error: ")) << result.err;
    return;
  }
  for (const auto& episode : Episodes(run_)) {
    EXPECT_GT(episode["extended"]["missing_ticks"], 0) << episode;
    EXPECT_EQ(episode["complete"], false);
  }
  ExpectLogged(run_, "metrics", "warning", "never arrived");
  EXPECT_NE(result.out.find("incomplete"), std::string::npos) << result.out;
}

// Datagrams that any program can send: noise, and LCM's headers with wrong fields. LCM's library does not
// check the offset of a fragment.
class Garbage {
 public:
  explicit Garbage(const std::string& url) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    const size_t host = std::strlen("udpm://"), colon = url.find(':', host);
    to_.sin_family = AF_INET;
    to_.sin_port = htons(static_cast<uint16_t>(std::stoi(url.substr(colon + 1))));
    EXPECT_EQ(inet_pton(AF_INET, url.substr(host, colon - host).c_str(), &to_.sin_addr), 1);
    const int ttl = 0;
    EXPECT_EQ(setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl), 0);
  }
  ~Garbage() { close(socket_); }
  Garbage(const Garbage&) = delete;
  Garbage& operator=(const Garbage&) = delete;

  void Publish() {
    std::string noise(random_() % 300, '\0');
    for (char& byte : noise) byte = static_cast<char>(random_());
    Send(noise);
    Send(std::string("LC02\0\0\0\1", 8) + std::string(random_() % 300, 'x'));
    // The second fragment lies beyond the end of its message, but the 32-bit sum of its offset and size
    // overflows and is within the message.
    const auto last = static_cast<uint32_t>(said_);
    Fragment(last, 100'000, 0, 0, 3, std::string("EVALBUS_STATE\0", 14) + noise);
    Fragment(last, 100'000, 0xFFFFFFF0, 1, 3, std::string(200, 'x'));
    // Sends two fragments on different channels, each of which claims to be a whole message of 60 MB. Then
    // sends two fragments with random fields.
    Fragment(last, 60'000'000, 0, 0, 1, std::string("EVALBUS_STATE\0", 14) + noise);
    Fragment(last, 60'000'000, 0, 0, 1, std::string("SOMETHING_ELSE\0", 15) + noise);
    const uint32_t sizes[] = {0, 100, 100'000, 1u << 28, 0xFFFFFFFF};
    const uint32_t offsets[] = {0, 1, 99, 0xFFFFFFFF, 0xFFFFFFF0, 0x80000000};
    const uint32_t size = sizes[random_() % std::size(sizes)], sequence = random_();
    const auto count = static_cast<uint16_t>(random_() % 3);
    Fragment(sequence, size, 0, 0, count, std::string("EVALBUS_STATE\0", 14) + noise);
    Fragment(sequence, size, offsets[random_() % std::size(offsets)], static_cast<uint16_t>(random_() % 2),
             count, std::string(16 + random_() % 200, 'x'));
  }
  int said() const { return said_; }

 private:
  void Fragment(uint32_t sequence, uint32_t size, uint32_t offset, uint16_t number, uint16_t count,
                const std::string& data) {
    const uint32_t words[] = {htonl(0x4c433033), htonl(sequence), htonl(size), htonl(offset),
                              htonl(uint32_t{number} << 16 | count)};
    Send(std::string(reinterpret_cast<const char*>(words), sizeof words) + data);
  }
  void Send(const std::string& datagram) {
    said_ += sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                    sizeof to_) > 0;
  }

  int socket_;
  sockaddr_in to_{};
  std::mt19937 random_{1};
  int said_ = 0;
};

int64_t PeakMemoryBytes(pid_t pid) {
  const std::string status = ReadText("/proc/" + std::to_string(pid) + "/status"), key = "VmHWM:";
  const size_t at = status.find(key);
  return at == std::string::npos ? 0 : std::stoll(status.substr(at + key.size())) * 1024;
}

TEST_F(UdpFaults, GarbageAndOversizedMessagesChangeNothing) {
  Garbage garbage(url_);
  // The message begins as a STATE but is far longer.
  std::vector<uint8_t> oversized;
  int64_t peak_memory_bytes = 0;
  int rounds = 0;
  beside_ = [&](pid_t launcher) {
    // The oversized messages are made from a STATE.
    if (state_.empty()) return;
    garbage.Publish();
    if (++rounds % 4 == 0) {
      oversized = state_;
      oversized.resize(300'000, 1);
      for (const char* channel : {channels::kState.name, channels::kPartial.name, channels::kStatus.name}) {
        bus_->PublishRaw(channel, oversized);
      }
    }
    for (const pid_t child : ChildrenOf(launcher)) {
      peak_memory_bytes = std::max(peak_memory_bytes, PeakMemoryBytes(child));
    }
  };
  const Result result = Run("");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("retrying"), std::string::npos) << result.out;
  ExpectSameScores(run_, reference_);
  EXPECT_GT(garbage.said(), 100);
  EXPECT_GT(decode_errors_["metrics"], 0);
  EXPECT_NE(result.out.find("\nmessages dropped by collision, metrics"), std::string::npos) << result.out;
  ExpectLogged(run_, "metrics", "warning",
               "that could not be decoded: from another program or version, or damaged");
  if (!kIsSanitized) {
    EXPECT_LT(peak_memory_bytes, 300'000'000);
  }
  for (int i = 0; i < 2; ++i) EXPECT_LT(fs::file_size(LogFile(run_, i)), 50'000'000u);
}

TEST_F(UdpFaults, SmallReceiveBuffers) {
  const std::string least = std::to_string(kLeastReceiveBufferBytes);
  ExpectTheSameOrAReason(Run("", {}, "&recv_buf_size=" + least));
  for (const char* size : {"4096", "0", "-1", "many", "65535"}) {
    SCOPED_TRACE(size);
    fs::remove_all(run_);
    const Result result = Run("", {}, std::string("&recv_buf_size=") + size);
    EXPECT_EQ(result.code, 1);
    EXPECT_NE(result.err.find("recv_buf_size: expected at least " + least + " bytes"), std::string::npos)
        << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(run_));
  }
}

}  // namespace evalbus::udp_faults_test
