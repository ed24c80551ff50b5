// Connection to a message bus: typed publish and subscribe on LCM, with the failures that LCM hides made
// visible.
//
// Not thread-safe: one thread publishes and handles. Handlers run inside Handle().
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "bus/channels.h"
#include "bus/message.h"

namespace lcm {
class LCM;
struct ReceiveBuffer;
}  // namespace lcm

namespace evalbus {

using SteadyTime = std::chrono::steady_clock::time_point;

// What a bus asks the kernel for, bytes: with its default large messages are lost.
inline constexpr int kReceiveBufferBytes = 4 << 20;

class Bus {
 public:
  // url: "memq://" (this process only) or "udpm://ADDRESS:PORT?ttl=0". A receive buffer of
  // kReceiveBufferBytes is asked for unless the URL names one. session: as in MODEL. Throws EnvironmentError,
  // with the fix, if the bus cannot be had.
  explicit Bus(const std::string& url, int64_t session = 0);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  const std::string& url() const { return url_; }
  int64_t session() const { return session_; }

  // Sends a message to ourselves and waits for it. Throws EnvironmentError if it does not arrive within a
  // second.
  void SelfCheck();

  // Throws EnvironmentError if the message cannot be sent.
  template <class Message>
  void Publish(const Channel<Message>& channel, const std::type_identity_t<Message>& message) {
    Encode(message, &buffer_);
    PublishRaw(channel.name, buffer_);
  }
  void PublishRaw(const std::string& channel, std::span<const uint8_t> data);

  // Calls handler for each message on the channel. A message that does not decode (other type, cut, too long)
  // is counted in decode_errors() and dropped. The queue is unlimited. What a handler throws comes out of
  // Handle().
  template <class Message>
  void Subscribe(const Channel<Message>& channel,
                 std::type_identity_t<std::function<void(const Message&)>> handler) {
    // The message object is kept, so that decoding into it reuses its storage.
    SubscribeRaw(channel.name, [this, handler = std::move(handler), message = Message{}](
                                   const std::string&, std::span<const uint8_t> data, int64_t) mutable {
      if (Decode(data, &message)) {
        handler(message);
      } else {
        ++decode_errors_;
      }
    });
  }

  // Undecoded messages of all channels that match a regular expression; receive_time_us is wall-clock time.
  using RawHandler =
      std::function<void(const std::string& channel, std::span<const uint8_t> data, int64_t receive_time_us)>;
  void SubscribeRaw(const std::string& channel_regex, RawHandler handler);

  // Handles one message if there is one before the deadline; false if there was none. Rethrows what a handler
  // threw.
  bool Handle(SteadyTime deadline);
  // The same without waiting.
  bool Handle() { return Handle(SteadyTime::min()); }

  // Bytes of the message that is being handled; valid inside its handler.
  std::span<const uint8_t> handled() const { return handled_; }

  int64_t decode_errors() const { return decode_errors_; }
  // For who decodes by itself.
  void CountDecodeError() { ++decode_errors_; }

 private:
  struct Subscription {
    Bus* bus;
    RawHandler handler;
    // The form that LCM calls; nothing may be thrown through its C frames.
    void Receive(const lcm::ReceiveBuffer* buffer, const std::string& channel);
  };

  std::string url_;
  int64_t session_;
  std::unique_ptr<lcm::LCM> lcm_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  // Subscribed channels, for the filter in the kernel; a regular expression switches that off.
  std::vector<std::string> channels_;
  bool hears_everything_ = false;
  std::vector<uint8_t> buffer_;
  std::span<const uint8_t> handled_;
  std::exception_ptr thrown_;
  int64_t decode_errors_ = 0;
};

// A new session, not 0.
int64_t DrawSession();

// A multicast URL of this machine on a port derived from `salt` (a process id, say).
std::string LocalMulticastUrl(uint32_t salt);

}  // namespace evalbus
