// Connection to a message bus: typed publish and subscribe on LCM, with the failures that LCM hides made
// visible. liblcm sends, and is the bus within a process; what comes from others our own receiver reads.
//
// Not thread-safe: one thread publishes and handles. Handlers run inside Handle().
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "bus/channels.h"
#include "bus/message.h"
#include "bus/trace.h"
#include "bus/wake_event.h"

namespace lcm {
class LCM;
}
// NOLINTNEXTLINE(bugprone-reserved-identifier): liblcm calls it so
struct _lcm_recv_buf_t;

namespace evalbus {

class MulticastReceiver;

using SteadyTime = std::chrono::steady_clock::time_point;

// What a bus asks the kernel for, bytes: with its default large messages are lost.
inline constexpr int kReceiveBufferBytes = 4 << 20;
// The least that a URL may name. On a machine with several times as many busy processes as cores, a run loses
// messages in every tick with 8 KiB and none with 16 KiB; larger scenes have larger messages.
inline constexpr int kLeastReceiveBufferBytes = 64 << 10;

class Bus {
 public:
  // url: "memq://" (this process only) or "udpm://ADDRESS:PORT?ttl=0". A receive buffer of
  // kReceiveBufferBytes is asked for unless the URL names one. session: of the run that this process belongs
  // to, as in MODEL: every message that has a session is published with this one, and received only with this
  // one. 0: messages are published as they are, and all are received. instance: as in STATUS; 0: each
  // component draws its own. Throws InputError for a URL that is none or names too small a buffer, and
  // EnvironmentError, with the fix, if the bus cannot be had.
  explicit Bus(const std::string& url, int64_t session = 0, int64_t instance = 0);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  const std::string& url() const { return url_; }
  int64_t session() const { return session_; }
  int64_t instance() const { return instance_; }

  // Sends a message to ourselves and waits for it. Throws EnvironmentError if it does not arrive within a
  // second.
  void SelfCheck();

  // Throws EnvironmentError if the message cannot be sent.
  template <class Message>
  void Publish(const Channel<Message>& channel, const std::type_identity_t<Message>& message) {
    Note(Trace::Event::kEncode, channel, {});
    Encode(message, &buffer_);
    if constexpr (HasSession<Message>) {
      if (session_ != 0) SetSession(session_, buffer_);
    }
    PublishRaw(channel.name, buffer_);
  }
  void PublishRaw(const char* channel, std::span<const uint8_t> data);

  // Calls handler for each message on the channel, decoded once for all handlers. A message that does not
  // decode (other type, cut, too long) is counted in decode_errors() and dropped. The queue is unlimited
  // within a process, else what the receive buffer holds. What a handler throws comes out of Handle().
  template <class Message>
  void Subscribe(const Channel<Message>& channel,
                 std::type_identity_t<std::function<void(const Message&)>> handler) {
    std::shared_ptr<void>& known = topics_[{channel.name, Message::getHash()}];
    if (!known) {
      const auto topic = std::make_shared<Topic<Message>>();
      topic->channel = channel;
      known = topic;
      SubscribeRaw(channel.name, [this, topic](std::string_view, std::span<const uint8_t> data, int64_t) {
        if (!Decode(data, &topic->message)) return CountDecodeError();
        Note(Trace::Event::kDecoded, topic->channel, data);
        // A handler may subscribe.
        for (size_t i = 0; i < topic->handlers.size(); ++i) topic->handlers[i](topic->message);
        Note(Trace::Event::kHandled, topic->channel, data);
      });
    }
    std::static_pointer_cast<Topic<Message>>(known)->handlers.push_back(std::move(handler));
  }

  // Undecoded messages of a channel or, for a name that ends in ".*", of all whose names begin so;
  // receive_time_us is wall-clock time.
  using RawHandler =
      std::function<void(std::string_view channel, std::span<const uint8_t> data, int64_t receive_time_us)>;
  void SubscribeRaw(const std::string& channels, RawHandler handler);

  // For who is in no hurry: messages may wait so long before they are handled, many at a time. As much of it
  // as the receive buffer allows.
  void SetMaxBatchDelay(std::chrono::nanoseconds delay);
  // What the kernel gives us for messages that wait; nothing within a process, where there is no end to it.
  std::optional<size_t> receive_buffer_bytes() const;

  // Handles one message if there is one before the deadline; false if there was none, or if wake_event() was
  // set while none was waiting. Rethrows what a handler threw.
  bool Handle(SteadyTime deadline);
  // The same without waiting.
  bool Handle() { return Handle(SteadyTime::min()); }

  // Ends the wait in Handle() from any thread, for work that a thread hands back to the owner of this bus.
  // May outlive the bus.
  const std::shared_ptr<WakeEvent>& wake_event() const { return wake_event_; }

  // Bytes of the message that is being handled; valid inside its handler.
  std::span<const uint8_t> handled() const { return handled_; }

  int64_t decode_errors() const;
  // Messages of other sessions that were dropped.
  int64_t foreign_messages() const { return foreign_messages_; }
  // For who decodes by itself.
  void CountDecodeError() { ++decode_errors_; }

 private:
  struct Subscription {
    Bus* bus;
    std::string channels;
    RawHandler handler;
    bool Matches(std::string_view channel) const;
    // The form that LCM calls; nothing may be thrown through its C frames.
    static void Receive(const _lcm_recv_buf_t* buffer, const char* channel, void* subscription);
  };
  // The message object is kept, so that decoding into it reuses its storage.
  template <class Message>
  struct Topic {
    std::string channel;
    Message message{};
    std::vector<std::function<void(const Message&)>> handlers;
  };

  void Note(Trace::Event event, std::string_view channel, std::span<const uint8_t> data) {
    if (trace_) trace_->Add(event, channel, data);
  }
  bool HandleReceived(SteadyTime deadline);
  // No message came: false, for Handle().
  bool EndWait(SteadyTime deadline);
  void Deliver(Subscription* to, std::string_view channel, std::span<const uint8_t> data, int64_t time_us);

  std::string url_;
  int64_t session_;
  int64_t instance_;
  std::unique_ptr<lcm::LCM> lcm_;
  std::shared_ptr<WakeEvent> wake_event_;
  std::unique_ptr<Trace> trace_ = Trace::OfEnvironment();
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  // By channel and type.
  std::map<std::pair<std::string, int64_t>, std::shared_ptr<void>> topics_;
  // From the first subscription on; not within a process.
  std::unique_ptr<MulticastReceiver> receiver_;
  std::vector<uint8_t> buffer_;
  std::span<const uint8_t> handled_;
  std::exception_ptr thrown_;
  int64_t decode_errors_ = 0;
  int64_t foreign_messages_ = 0;
};

// Throws InputError for a udpm:// URL with a receive buffer in which messages are lost: a policy that never
// receives a STATE would be scored as one that does not answer.
void CheckReceiveBuffer(const std::string& url);

// A random id, not 0, for a session or an instance.
int64_t DrawId();

}  // namespace evalbus
