#include "bus/bus.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <system_error>

#include "base/environment_choice.h"
#include "base/errors.h"
#include "base/poll.h"
#include "bus/udpm/multicast_receiver.h"

namespace evalbus {
namespace {

constexpr char kMulticastFix[] =
    "no multicast on this machine; fix: "
    "'ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo' as root, "
    "or use --in-process (see 'evalbus doctor')";

// A subscription with this suffix matches all channels that begin with the rest of its name.
constexpr std::string_view kAnyEnd = ".*";

bool IsMulticast(const std::string& url) { return url.rfind("udpm://", 0) == 0; }

// Adds the default receive buffer size to a multicast URL that does not specify one.
std::string WithReceiveBuffer(const std::string& url) {
  if (!IsMulticast(url) || url.find("recv_buf_size=") != std::string::npos) return url;
  return url + (url.find('?') == std::string::npos ? "?" : "&") +
         "recv_buf_size=" + std::to_string(kReceiveBufferBytes);
}

// Checks that enough file descriptors are left, because liblcm crashes without them.
void CheckLimits(const std::string& url) {
  constexpr size_t kFiles = 12;  // slightly more than liblcm opens
  std::vector<int> files;
  while (files.size() < kFiles) {
    const int fd = eventfd(0, EFD_CLOEXEC);
    if (fd < 0) break;
    files.push_back(fd);
  }
  for (const int fd : files) close(fd);
  if (files.size() < kFiles) {
    throw EnvironmentError("cannot open bus " + url + ": too many open files; 'ulimit -n 256' is enough");
  }
}

}  // namespace

void CheckReceiveBuffer(const std::string& url) {
  if (ParseMulticastUrl(url, kReceiveBufferBytes).receive_buffer_bytes >= kLeastReceiveBufferBytes) return;
  throw InputError("bus URL '" + url + "': recv_buf_size: expected at least " +
                   std::to_string(kLeastReceiveBufferBytes) + " bytes, or messages are lost");
}

Bus::Bus(const std::string& url, int64_t session, int64_t instance)
    : url_(url), session_(session), instance_(instance) {
  if (url != "memq://" && !IsMulticast(url)) {
    throw InputError("bus URL '" + url + "': expected udpm://ADDRESS:PORT?ttl=0 or memq://");
  }
  if (IsMulticast(url)) {
    CheckMulticastAddress(url);
    CheckReceiveBuffer(url);
    CheckLimits(url);
  }
  liblcm_receives_ = EnvironmentSelects("EVALBUS_LCM_RECEIVER", "liblcm", "evalbus") || !IsMulticast(url);
  wake_event_ = std::make_shared<WakeEvent>();
  lcm_ = std::make_unique<lcm::LCM>(liblcm_receives_ ? WithReceiveBuffer(url) : url);
  if (!lcm_->good()) throw EnvironmentError("cannot open bus " + url + ": bad address, or " + kMulticastFix);
}

Bus::~Bus() = default;

void Bus::SelfCheck() {
  static constexpr char kChannel[] = "EVALBUS_SELF_CHECK";
  const auto received = std::make_shared<bool>(false);
  SubscribeRaw(kChannel,
               [received](std::string_view, std::span<const uint8_t>, int64_t) { *received = true; });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  const uint8_t byte = 0;
  PublishRaw(kChannel, {&byte, 1});
  while (!*received && Handle(deadline)) {
  }
  if (!*received) throw EnvironmentError("bus " + url_ + " does not deliver: " + kMulticastFix);
}

void Bus::PublishRaw(const char* channel, std::span<const uint8_t> data) {
  Note(Trace::Event::kSend, channel, data);
  // The C function is called directly, because the C++ function copies the channel's name.
  if (lcm_publish(lcm_->getUnderlyingLCM(), channel, data.data(), static_cast<unsigned>(data.size())) != 0) {
    throw EnvironmentError(std::string("cannot publish on ") + channel + " (bus " + url_ + ")");
  }
  Note(Trace::Event::kSent, channel, data);
}

void Bus::SubscribeRaw(const std::string& channels, RawHandler handler) {
  subscriptions_.push_back(std::make_unique<Subscription>(Subscription{this, channels, std::move(handler)}));
  if (liblcm_receives_) return SubscribeWithLiblcm(subscriptions_.back().get());
  std::vector<std::string> wanted;
  for (const auto& subscription : subscriptions_) wanted.push_back(subscription->channels);
  if (receiver_) return receiver_->Filter(wanted);
  try {
    receiver_ = std::make_unique<MulticastReceiver>(ParseMulticastUrl(url_, kReceiveBufferBytes), wanted,
                                                    wake_event_->fd());
  } catch (const std::system_error& error) {
    throw EnvironmentError("cannot open bus " + url_ + " (" + error.code().message() + "): " + kMulticastFix);
  }
}

void Bus::SubscribeWithLiblcm(Subscription* subscription) {
  lcm_subscription_t* const subscribed = lcm_subscribe(
      lcm_->getUnderlyingLCM(), subscription->channels.c_str(), &Subscription::Receive, subscription);
  // 0 means unlimited. With the default of 30, LCM silently drops the newest message if the queue is full.
  lcm_subscription_set_queue_capacity(subscribed, 0);
}

bool Bus::Subscription::Matches(std::string_view channel) const {
  if (!channels.ends_with(kAnyEnd)) return channel == channels;
  return channel.starts_with(std::string_view(channels).substr(0, channels.size() - kAnyEnd.size()));
}

void Bus::SetMaxBatchDelay(std::chrono::nanoseconds delay) {
  if (receiver_) receiver_->SetMaxBatchDelay(delay);
}

std::optional<size_t> Bus::receive_buffer_bytes() const {
  return receiver_ ? std::optional(receiver_->receive_buffer_bytes()) : std::nullopt;
}

int64_t Bus::decode_errors() const { return decode_errors_ + (receiver_ ? receiver_->lost() : 0); }

void Bus::Deliver(Subscription* to, std::string_view channel, std::span<const uint8_t> data,
                  int64_t time_us) {
  if (session_ != 0 && channels::CarriesSession(channel) && SessionOf(data) != session_) {
    // The message is counted once: at the first of the subscriptions that match.
    const auto first =
        std::ranges::find_if(subscriptions_, [&](const auto& s) { return s->Matches(channel); });
    if (first->get() == to) ++foreign_messages_;
    return;
  }
  Note(Trace::Event::kReceived, channel, data);
  handled_ = data;
  to->handler(channel, data, time_us);
}

void Bus::Subscription::Receive(const _lcm_recv_buf_t* buffer, const char* channel, void* subscription) {
  auto* const self = static_cast<Subscription*>(subscription);
  const auto* data = static_cast<const uint8_t*>(buffer->data);
  try {
    self->bus->Deliver(self, channel, {data, buffer->data_size}, buffer->recv_utime);
  } catch (...) {
    if (!self->bus->thrown_) self->bus->thrown_ = std::current_exception();
  }
}

bool Bus::EndWait(SteadyTime deadline) {
  // If the caller did not wait, it does not check why the event was set, so the event must stay set.
  if (deadline != SteadyTime::min()) wake_event_->Clear();
  return false;
}

bool Bus::HandleWithLiblcm(SteadyTime deadline) {
  if (!WaitReadable(lcm_->getFileno(), wake_event_->fd(), deadline)) return EndWait(deadline);
  if (lcm_->handle() != 0) throw EnvironmentError("bus " + url_ + " failed while receiving");
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  return true;
}

bool Bus::Handle(SteadyTime deadline) {
  if (liblcm_receives_) return HandleWithLiblcm(deadline);
  if (!receiver_) {
    WaitReadable(-1, wake_event_->fd(), deadline);
    return EndWait(deadline);
  }
  std::optional<MulticastReceiver::Received> received;
  try {
    received = receiver_->Next(deadline);
  } catch (const std::system_error& error) {
    throw EnvironmentError("bus " + url_ + " failed while receiving: " + error.code().message());
  }
  if (!received) return EndWait(deadline);
  const auto& [message, time_us] = *received;
  // The loop uses an index, because a handler may subscribe and thereby invalidate iterators.
  for (size_t i = 0; i < subscriptions_.size(); ++i) {
    if (!subscriptions_[i]->Matches(message.channel)) continue;
    Deliver(subscriptions_[i].get(), message.channel, message.data, time_us);
  }
  return true;
}

int64_t DrawId() {
  std::random_device random;
  return static_cast<int64_t>(uint64_t{random()} << 32 | random() | 1);
}

}  // namespace evalbus
