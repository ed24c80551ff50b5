// Compares our receiver with liblcm's on the same traffic.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <lcm/lcm-cpp.hpp>
#include <random>

#include "base/sha256.h"
#include "tests/integration/harness.h"
#include "tests/unit/lcm_datagram.h"

namespace evalbus::receiver_test {

using Received = std::vector<std::string>;

// The channel on which liblcm tests whether it receives its own messages.
constexpr std::string_view kSelfTest = "LCM_SELF_TEST";

std::string Line(std::string_view channel, std::span<const uint8_t> data) {
  return fmt::format("{} {} bytes {}", channel, data.size(),
                     Sha256Text({reinterpret_cast<const char*>(data.data()), data.size()}));
}

// A program that sends to a bus without liblcm.
class Sender {
 public:
  explicit Sender(const std::string& url) {
    const size_t host = std::strlen("udpm://"), colon = url.find(':', host);
    group_.sin_family = AF_INET;
    group_.sin_port = htons(static_cast<uint16_t>(std::stoi(url.substr(colon + 1))));
    inet_pton(AF_INET, url.substr(host, colon - host).c_str(), &group_.sin_addr);
    const int ttl = 0;
    setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  }
  ~Sender() { close(socket_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void Send(const std::string& datagram) {
    ASSERT_EQ(sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&group_),
                     sizeof group_),
              static_cast<ssize_t>(datagram.size()));
  }

 private:
  int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in group_{};
};

class Receiver : public testing::Test {
 protected:
  void SetUp() override {
    EVALBUS_NEEDS_BUS();
    ours_.emplace(url_);
    ours_->SubscribeRaw(".*",
                        [this](std::string_view channel, std::span<const uint8_t> data, int64_t time_us) {
                          if (channel == kSelfTest) return;
                          by_us_.push_back(Line(channel, data));
                          time_us_ = time_us;
                        });
    theirs_.emplace(url_ + "&recv_buf_size=4194304");
    theirs_->subscribe(".*", &Receiver::ReceiveTheirs, this)->setQueueCapacity(0);
  }
  void ReceiveTheirs(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    by_them_.push_back(Line(channel, {static_cast<const uint8_t*>(buffer->data), buffer->data_size}));
  }
  // Receives until both receivers have received this text, which is sent last.
  void ReceiveUntil(const std::string& line) {
    const auto has = [&](const Received& received) { return !received.empty() && received.back() == line; };
    ASSERT_TRUE(WaitFor([&] {
      while (ours_->Handle()) {
      }
      while (theirs_->handleTimeout(0) > 0) {
      }
      return has(by_us_) && has(by_them_);
    })) << by_us_.size()
        << " " << by_them_.size();
  }

  const std::string url_ = UniqueUrl();
  std::optional<Bus> ours_;
  std::optional<lcm::LCM> theirs_;
  Received by_us_, by_them_;
  int64_t time_us_ = 0;
};

// Three senders interleave their datagrams, and some datagrams are lost.
TEST_F(Receiver, MakesOfAnyTrafficWhatLiblcmMakes) {
  // liblcm reads in a separate thread, which starts late on a loaded machine. Pending messages must fit into
  // the kernel's buffer, or liblcm loses them.
  constexpr size_t kMaxWaitingBytes = 200'000;
  std::mt19937 random(3);
  const auto below = [&](size_t n) { return static_cast<size_t>(random()) % n; };
  constexpr size_t kSizes[] = {0, 1, 7, 1000, 3000, 65'400, 66'000, 200'000, 700'000};
  std::vector<std::unique_ptr<Sender>> senders;
  for (int i = 0; i < 3; ++i) senders.push_back(std::make_unique<Sender>(url_));
  std::vector<std::vector<std::string>> waiting(senders.size());
  uint32_t sequence = 0;
  size_t waiting_bytes = 0;
  for (int datagrams = 0; datagrams < 3000; ++datagrams) {
    const size_t i = below(senders.size());
    if (waiting[i].empty()) {
      const std::string channel(1 + below(kMaxChannelBytes), static_cast<char>('A' + below(26)));
      std::string data(kSizes[below(std::size(kSizes))], '\0');
      for (size_t byte = 0; byte < data.size(); byte += 1 + below(500))
        data[byte] = static_cast<char>(random());
      waiting[i] = channel.size() + data.size() < 65'000
                       ? std::vector{MessageDatagram(++sequence, channel, data)}
                       : Fragments(++sequence, channel, data, 1'000 * (1 + below(65)));
      std::ranges::reverse(waiting[i]);
    }
    if (below(50) != 0) {
      senders[i]->Send(waiting[i].back());
      waiting_bytes += waiting[i].back().size();
    }
    waiting[i].pop_back();
    while (ours_->Handle()) {
    }
    if (waiting_bytes > kMaxWaitingBytes) {
      const std::string number = std::to_string(datagrams);
      Sender(url_).Send(MessageDatagram(0, "PAUSE", number));
      ReceiveUntil(Line("PAUSE", AsBytes(number)));
      waiting_bytes = 0;
    }
  }
  Sender last(url_);
  last.Send(MessageDatagram(0, "LAST", "x"));
  ReceiveUntil(Line("LAST", AsBytes("x")));
  EXPECT_GT(by_us_.size(), 200u);
  EXPECT_EQ(by_us_, by_them_);
}

// Both receivers receive what liblcm sends, such as a message that exactly fills a datagram and one that is a
// byte longer. Our receiver also receives 64 MB that are sent slowly enough for the kernel's buffer.
TEST_F(Receiver, ReceivesMessagesOfEverySize) {
  for (const size_t size : {size_t{1}, size_t{65'499} - sizeof "SIZE", size_t{65'500} - sizeof "SIZE",
                            size_t{65'501} - sizeof "SIZE", size_t{131'000}, size_t{3} << 20}) {
    std::vector<uint8_t> data(size);
    for (size_t i = 0; i < size; ++i) data[i] = static_cast<uint8_t>(i * 7 + i / 251);
    ours_->PublishRaw("SIZE", data);
    ReceiveUntil(Line("SIZE", data));
  }
  EXPECT_EQ(by_us_, by_them_);
  EXPECT_EQ(by_us_.size(), 6u);

  const std::string large(kMaxMessageBytes, 'z');
  Sender sender(url_);
  for (const std::string& fragment : Fragments(1, "LARGE", large, 65'487)) {
    sender.Send(fragment);
    while (ours_->Handle()) {
    }
  }
  EXPECT_EQ(by_us_.back(), Line("LARGE", AsBytes(large)));
}

TEST_F(Receiver, StatesWhenAMessageArrived) {
  const auto now_us = [] {
    return std::chrono::duration_cast<std::chrono::microseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
  const int64_t before = now_us();
  Sender(url_).Send(MessageDatagram(1, "A", "x"));
  ReceiveUntil(Line("A", AsBytes("x")));
  EXPECT_GE(time_us_, before);
  EXPECT_LE(time_us_, now_us());
}

// Two buses have different groups on one port, as happens to programs that do not reserve the port.
TEST(Receivers, GroupsThatShareAPortReceiveOnlyTheirOwn) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl(), port = url.substr(url.rfind(":"));
  Bus a("udpm://239.255.1.1" + port), b("udpm://239.255.1.2" + port);
  Received received_a, received_b;
  const auto note = [](Received* received) {
    return [received](std::string_view channel, std::span<const uint8_t>, int64_t) {
      received->emplace_back(channel);
    };
  };
  a.SubscribeRaw("EVALBUS_GROUP.*", note(&received_a));
  b.SubscribeRaw("EVALBUS_GROUP.*", note(&received_b));
  const uint8_t byte = 0;
  // Messages arrive in the order sent, so the last message of each bus proves that the others did not arrive.
  a.PublishRaw("EVALBUS_GROUP_OF_A", {&byte, 1});
  b.PublishRaw("EVALBUS_GROUP_OF_B", {&byte, 1});
  a.PublishRaw("EVALBUS_GROUP_END", {&byte, 1});
  b.PublishRaw("EVALBUS_GROUP_END", {&byte, 1});
  EXPECT_TRUE(WaitFor([&] {
    a.Handle();
    b.Handle();
    return std::ranges::count(received_a, "EVALBUS_GROUP_END") > 0 &&
           std::ranges::count(received_b, "EVALBUS_GROUP_END") > 0;
  }));
  EXPECT_EQ(received_a, (Received{"EVALBUS_GROUP_OF_A", "EVALBUS_GROUP_END"}));
  EXPECT_EQ(received_b, (Received{"EVALBUS_GROUP_OF_B", "EVALBUS_GROUP_END"}));
}

// Sets EVALBUS_LCM_RECEIVER during its lifetime.
class WithReceiver {
 public:
  explicit WithReceiver(const char* receiver) { setenv("EVALBUS_LCM_RECEIVER", receiver, 1); }
  ~WithReceiver() { unsetenv("EVALBUS_LCM_RECEIVER"); }
  WithReceiver(const WithReceiver&) = delete;
  WithReceiver& operator=(const WithReceiver&) = delete;
};

TEST(ReceiverChoice, WithLiblcmTheBusDeliversTheSameMessages) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl();
  Received by_ours, by_liblcm;
  const auto note = [](Received* received) {
    return [received](std::string_view channel, std::span<const uint8_t> data, int64_t) {
      received->push_back(Line(channel, data));
    };
  };
  Bus ours(url);
  ours.SubscribeRaw("A.*", note(&by_ours));
  std::optional<Bus> liblcm;
  {
    const WithReceiver receiver("liblcm");
    liblcm.emplace(url);
  }
  liblcm->SubscribeRaw("A.*", note(&by_liblcm));
  EXPECT_TRUE(ours.receive_buffer_bytes());
  EXPECT_FALSE(liblcm->receive_buffer_bytes());
  for (const size_t size : {size_t{0}, size_t{1000}, size_t{65'600}, size_t{1} << 20}) {
    const std::vector<uint8_t> data(size, 7);
    ours.PublishRaw("B", data);  // not subscribed
    ours.PublishRaw("A1", data);
    liblcm->PublishRaw("A2", data);
    const size_t expected = by_ours.size() + 2;
    EXPECT_TRUE(WaitFor([&] {
      while (ours.Handle()) {
      }
      while (liblcm->Handle()) {
      }
      return by_ours.size() >= expected && by_liblcm.size() >= expected;
    }));
  }
  EXPECT_EQ(by_ours, by_liblcm);
  EXPECT_EQ(by_ours.size(), 8u);
}

TEST(ReceiverChoice, ARunHasTheSameResultsWithLiblcm) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::vector<std::string> arguments = {"lift_pot/position", "--policy", "noisy_expert", "--episodes",
                                              "2"};
  Evaluate(arguments, folder.path() / "ours");
  {
    const WithReceiver receiver("liblcm");
    Evaluate(arguments, folder.path() / "liblcm");
  }
  ExpectSameScores(folder.path() / "ours", folder.path() / "liblcm");
  for (int episode = 0; episode < 2; ++episode) {
    ExpectSameTicks(ReadLog(LogFile(folder.path() / "ours", episode)),
                    ReadLog(LogFile(folder.path() / "liblcm", episode)));
  }
}

TEST(ReceiverChoice, AnUnknownOneIsOneLine) {
  const Result result = RunProgram({"evalbus", "monitor", "--url", "udpm://239.255.1.1:7667?ttl=0"},
                                   {{}, [] { setenv("EVALBUS_LCM_RECEIVER", "lcm", 1); }});
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.err, "error: EVALBUS_LCM_RECEIVER: expected evalbus or liblcm, got lcm\n");
}

}  // namespace evalbus::receiver_test
