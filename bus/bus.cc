#include "bus/bus.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <system_error>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "bus/channel_filter.h"

namespace evalbus {
namespace {

constexpr char kMulticastFix[] =
    "no multicast on this machine; fix: "
    "'ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo' as root, "
    "or use --in-process (see 'evalbus doctor')";

constexpr char kFirstChannel[] = "EVALBUS_FIRST_";

bool IsMulticast(const std::string& url) { return url.rfind("udpm://", 0) == 0; }

// liblcm has accepted the URL; without a port it takes 7667.
int PortOf(const std::string& url) {
  const size_t colon = url.find(':', sizeof "udpm://" - 1);
  return colon == std::string::npos ? 7667 : std::atoi(url.c_str() + colon + 1);
}

// liblcm, too, sends no further than this machine where no ttl is named.
bool IsLocal(const std::string& url) {
  const size_t ttl = url.find("ttl=");
  return ttl == std::string::npos || std::atoi(url.c_str() + ttl + sizeof "ttl=" - 1) == 0;
}

std::string WithReceiveBuffer(const std::string& url) {
  if (!IsMulticast(url) || url.find("recv_buf_size=") != std::string::npos) return url;
  return url + (url.find('?') == std::string::npos ? "?" : "&") +
         "recv_buf_size=" + std::to_string(kReceiveBufferBytes);
}

// liblcm crashes where it gets no file or thread more.
void CheckLimits(const std::string& url) {
  constexpr size_t kFiles = 12;  // as many as it opens, and some
  std::vector<int> files;
  while (files.size() < kFiles) {
    const int fd = eventfd(0, EFD_CLOEXEC);
    if (fd < 0) break;
    files.push_back(fd);
  }
  for (const int fd : files) close(fd);
  if (files.size() < kFiles) {
    throw EnvironmentError("cannot open bus " + url +
                           ": no more files may be open at once; 'ulimit -n 256' is enough");
  }
  try {
    std::thread([] {}).join();
  } catch (const std::system_error&) {
    throw EnvironmentError("cannot open bus " + url + ": no more processes may be started (see 'ulimit -u')");
  }
}

}  // namespace

Bus::Bus(const std::string& url, int64_t session) : url_(url), session_(session) {
  if (url != "memq://" && !IsMulticast(url)) {
    throw InputError("bus URL '" + url + "': expected udpm://ADDRESS:PORT?ttl=0 or memq://");
  }
  if (IsMulticast(url)) CheckLimits(url);
  lcm_ = std::make_unique<lcm::LCM>(WithReceiveBuffer(url));
  if (!lcm_->good()) throw EnvironmentError("cannot open bus " + url + ": bad address, or " + kMulticastFix);
}

Bus::~Bus() = default;

void Bus::SelfCheck() {
  static constexpr char kChannel[] = "EVALBUS_SELF_CHECK";
  const auto heard = std::make_shared<bool>(false);
  SubscribeRaw(kChannel, [heard](const std::string&, std::span<const uint8_t>, int64_t) { *heard = true; });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  const uint8_t byte = 0;
  PublishRaw(kChannel, {&byte, 1});
  while (!*heard && Handle(deadline)) {
  }
  if (!*heard) throw EnvironmentError("bus " + url_ + " does not deliver: " + kMulticastFix);
}

void Bus::PublishRaw(const std::string& channel, std::span<const uint8_t> data) {
  if (lcm_->publish(channel, data.data(), static_cast<unsigned>(data.size())) != 0) {
    throw EnvironmentError("cannot publish on " + channel + " (bus " + url_ + ")");
  }
}

void Bus::SubscribeRaw(const std::string& channel_regex, RawHandler handler) {
  // liblcm opens its socket with the first subscription, and hears before the socket has its filter: let that
  // be to a channel whose name nobody else knows.
  if (IsMulticast(url_) && subscriptions_.empty() && !channel_regex.starts_with(kFirstChannel)) {
    SubscribeRaw(kFirstChannel + std::to_string(std::random_device{}()),
                 [](const std::string&, std::span<const uint8_t>, int64_t) {});
  }
  subscriptions_.push_back(std::make_unique<Subscription>(Subscription{this, std::move(handler)}));
  auto* subscription = lcm_->subscribe(channel_regex, &Subscription::Receive, subscriptions_.back().get());
  // 0 = unlimited; the default of 30 drops the newest message without a word.
  subscription->setQueueCapacity(0);

  const bool is_name = std::all_of(channel_regex.begin(), channel_regex.end(),
                                   [](unsigned char c) { return std::isalnum(c) || c == '_'; });
  if (!is_name) hears_everything_ = true;
  channels_.push_back(channel_regex);
  if (IsMulticast(url_)) {
    FilterChannels(PortOf(url_), IsLocal(url_),
                   hears_everything_ ? std::span<const std::string>() : channels_);
  }
}

void Bus::Subscription::Receive(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
  // liblcm takes the NUL behind the channel's name for granted: without one it counts -1 bytes of data.
  if (buffer->data_size > kMaxMessageBytes) {
    ++bus->decode_errors_;
    return;
  }
  try {
    bus->handled_ = {static_cast<const uint8_t*>(buffer->data), buffer->data_size};
    handler(channel, bus->handled_, buffer->recv_utime);
  } catch (...) {
    if (!bus->thrown_) bus->thrown_ = std::current_exception();
  }
}

bool Bus::Handle(SteadyTime deadline) {
  pollfd fd{lcm_->getFileno(), POLLIN, 0};
  timespec wait{};
  if (deadline != SteadyTime::min()) {
    const auto left = deadline - std::chrono::steady_clock::now();
    const auto ns = std::max<int64_t>(0, std::chrono::duration_cast<std::chrono::nanoseconds>(left).count());
    wait = {ns / 1'000'000'000, ns % 1'000'000'000};
  }
  // A signal (Ctrl-C) ends the wait early; the caller looks at its flags.
  if (ppoll(&fd, 1, &wait, nullptr) <= 0) return false;
  if (lcm_->handle() != 0) throw EnvironmentError("bus " + url_ + " failed while receiving");
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  return true;
}

int64_t DrawSession() {
  std::random_device random;
  return static_cast<int64_t>(uint64_t{random()} << 32 | random() | 1);
}

std::string LocalMulticastUrl(uint32_t salt) {
  // Knuth's multiplicative hash spreads neighbouring process ids over the unprivileged ports.
  const uint32_t port = 20000 + (salt * 2654435761u >> 8) % 40000;
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
}

}  // namespace evalbus
