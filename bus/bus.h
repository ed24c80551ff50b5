// Connection to a message bus: typed publish and subscribe on LCM. Reports the failures that LCM hides.
// liblcm sends all messages, and delivers them within a process (memq). Messages of other processes are
// received by MulticastReceiver, or by liblcm if the environment has EVALBUS_LCM_RECEIVER=liblcm
// (docs/design/0001-own-udp-receiver.md).
//
// Not thread-safe: the same thread must publish and handle messages. Handlers run inside Handle().
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
// NOLINTNEXTLINE(bugprone-reserved-identifier): the name is liblcm's
struct _lcm_recv_buf_t;

namespace evalbus {

class MulticastReceiver;

using SteadyTime = std::chrono::steady_clock::time_point;

// Receive buffer requested from the kernel, in bytes. With the kernel's default, large messages are lost.
inline constexpr int kReceiveBufferBytes = 4 << 20;
// Smallest buffer that a URL may request. On a machine with several times as many busy processes as cores, a
// run loses messages in every tick with 8 KiB and none with 16 KiB. The limit is higher because larger scenes
// have larger messages.
inline constexpr int kLeastReceiveBufferBytes = 64 << 10;

class Bus {
 public:
  // url: "memq://" (this process only) or "udpm://ADDRESS:PORT?ttl=0". A receive buffer of
  // kReceiveBufferBytes is requested unless the URL specifies one.
  //
  // session: session of this process's run, as in MODEL. Publish() sets this value in every message with a
  // session field. Messages with a different value are dropped, except on channels of a source, which does
  // not know the session. 0: messages are published unchanged, and all are received.
  //
  // instance: as in STATUS. 0: each component draws its own instance.
  //
  // Throws InputError if the URL or EVALBUS_LCM_RECEIVER is invalid or too small a buffer is requested, and
  // EnvironmentError, with the fix, if the bus cannot be opened.
  explicit Bus(const std::string& url, int64_t session = 0, int64_t instance = 0);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  const std::string& url() const { return url_; }
  int64_t session() const { return session_; }
  int64_t instance() const { return instance_; }

  // Publishes a message and waits until this process receives it. Throws EnvironmentError if it does not
  // arrive within a second.
  void SelfCheck();

  // Publish() and PublishRaw() throw EnvironmentError if the message cannot be sent. PublishRaw() does not
  // set the session.
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

  // Calls handler for each message on the channel; the message is decoded once for all handlers. A message
  // that cannot be decoded (other type, truncated, too long) is counted in decode_errors() and dropped.
  // If liblcm receives, the queue is unlimited; otherwise the receive buffer limits it. Exceptions of a
  // handler propagate out of Handle().
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
        // The loop uses an index, because a handler may subscribe and thereby invalidate iterators.
        for (size_t i = 0; i < topic->handlers.size(); ++i) topic->handlers[i](topic->message);
        Note(Trace::Event::kHandled, topic->channel, data);
      });
    }
    std::static_pointer_cast<Topic<Message>>(known)->handlers.push_back(std::move(handler));
  }

  // Undecoded messages of a channel or, if the name ends in ".*", of all channels with that prefix.
  // receive_time_us is wall-clock time.
  using RawHandler =
      std::function<void(std::string_view channel, std::span<const uint8_t> data, int64_t receive_time_us)>;
  void SubscribeRaw(const std::string& channels, RawHandler handler);

  // Allows messages to be delayed by up to `delay`, so that one wake-up handles many. The receive buffer may
  // limit the delay further. The call has no effect before the first subscription, or if liblcm receives.
  // Components whose answers other components wait for should leave the delay at 0.
  void SetMaxBatchDelay(std::chrono::nanoseconds delay);
  // Returns the size of the receive buffer that the kernel granted. Returns nullopt before the first
  // subscription, and if liblcm receives, because its queue is unlimited.
  std::optional<size_t> receive_buffer_bytes() const;

  // Handles one message if one arrives before the deadline. Returns false if no message arrived, after a
  // signal, or if wake_event() was set while no message was queued. Rethrows the exception of a handler.
  // Throws EnvironmentError if receiving fails.
  bool Handle(SteadyTime deadline);
  // Handles one message that has already arrived. Returns false if there is none; does not wait.
  bool Handle() { return Handle(SteadyTime::min()); }

  // Setting this event from any thread ends the wait in Handle(), so that a thread can hand work back to the
  // thread of this bus. The event may outlive the bus.
  const std::shared_ptr<WakeEvent>& wake_event() const { return wake_event_; }

  // Bytes of the message that is being handled. Valid only inside its handler.
  std::span<const uint8_t> handled() const { return handled_; }

  // Return the number of messages that could not be decoded, and of messages of which only some fragments
  // arrived.
  int64_t decode_errors() const;
  // Returns the number of dropped messages of other sessions.
  int64_t foreign_messages() const { return foreign_messages_; }
  // Counts a decode error. Must be called by subscribers of raw messages, which decode messages themselves.
  void CountDecodeError() { ++decode_errors_; }

 private:
  struct Subscription {
    Bus* bus;
    std::string channels;
    RawHandler handler;
    bool Matches(std::string_view channel) const;
    // Callback with LCM's signature. It must not throw, because exceptions cannot pass through LCM's C code.
    static void Receive(const _lcm_recv_buf_t* buffer, const char* channel, void* subscription);
  };
  // Keeps the message object, so that decoding into it reuses its storage.
  template <class Message>
  struct Topic {
    std::string channel;
    Message message{};
    std::vector<std::function<void(const Message&)>> handlers;
  };

  void Note(Trace::Event event, std::string_view channel, std::span<const uint8_t> data) {
    if (trace_) trace_->Add(event, channel, data);
  }
  void SubscribeWithLiblcm(Subscription* subscription);
  bool HandleWithLiblcm(SteadyTime deadline);
  // Ends a Handle() that received no message. Always returns false, which Handle() then returns.
  bool EndWait(SteadyTime deadline);
  void Deliver(Subscription* to, std::string_view channel, std::span<const uint8_t> data, int64_t time_us);

  std::string url_;
  int64_t session_;
  int64_t instance_;
  std::unique_ptr<lcm::LCM> lcm_;
  std::shared_ptr<WakeEvent> wake_event_;
  std::unique_ptr<Trace> trace_ = Trace::OfEnvironment();
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  // Topics by channel and message type.
  std::map<std::pair<std::string, int64_t>, std::shared_ptr<void>> topics_;
  // True for a bus within this process (memq), or if EVALBUS_LCM_RECEIVER selects liblcm.
  bool liblcm_receives_;
  // The receiver is created at the first subscription, unless liblcm receives.
  std::unique_ptr<MulticastReceiver> receiver_;
  std::vector<uint8_t> buffer_;
  std::span<const uint8_t> handled_;
  std::exception_ptr thrown_;
  int64_t decode_errors_ = 0;
  int64_t foreign_messages_ = 0;
};

// Throws InputError if a udpm:// URL requests less than kLeastReceiveBufferBytes, because messages would be
// lost. In real time, a policy that misses a STATE would be scored as if it had not answered.
void CheckReceiveBuffer(const std::string& url);

// Returns a random id, not 0, for a session or an instance.
int64_t DrawId();

}  // namespace evalbus
