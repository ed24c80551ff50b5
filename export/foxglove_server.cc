#include "export/foxglove_server.h"

#include <fmt/format.h>

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <map>
#include <set>

#include "base/errors.h"
#include "viz/web/listener.h"
#include "viz/web/request.h"
#include "viz/web/websocket_session.h"

namespace evalbus::exports {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr char kFoxgloveOrigin[] = "https://app.foxglove.dev";
constexpr uint32_t kMaxHeader = 8192;
constexpr size_t kMaxMessage = 64 << 10;
constexpr std::chrono::seconds kTimeout{30};

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

// Except for num_viewers and listener, members are used only on the server's thread, or while it does not
// run.
struct FoxgloveServer::Core {
  class Viewer;
  class Handshake;

  explicit Core(Options the_options) : options(std::move(the_options)) {}

  void Listen();
  // Returns the reason why this request is rejected; empty if it is accepted.
  std::string Refusal(const http::request<http::empty_body>& request);

  const Options options;
  bool is_loopback = true;
  std::vector<Topic> topics;
  // Channels that were replaced by a later topic of the same name.
  std::set<size_t> gone;
  std::map<size_t, Message> kept{};
  std::optional<PlaybackState> playback;
  std::set<Viewer*> viewers;
  std::atomic<int> num_viewers = 0;
  // Declared after the members that connections use, so that it is destroyed before them.
  viz::Listener listener;
};

class FoxgloveServer::Core::Viewer : public viz::WebSocketSession {
 public:
  Viewer(Core* core, beast::tcp_stream stream)
      : WebSocketSession(std::move(stream), {kTimeout, 2 * kTimeout, kMaxMessage}), core_(core) {}
  ~Viewer() override {
    core_->viewers.erase(this);
    core_->num_viewers = static_cast<int>(core_->viewers.size());
  }

  void Start(const Request& request) {
    const std::string subprotocol = ChooseSubprotocol(View(request[http::field::sec_websocket_protocol]));
    has_playback_ = core_->options.playback_end_ns && SupportsPlayback(subprotocol);
    Accept(request, subprotocol);
  }

  void SendText(std::string text) {
    control_.push_back(FrameOf(false, std::move(text)));
    Write();
  }
  void SendPlayback(const PlaybackState& state) {
    if (!has_playback_) return;
    control_.push_back(FrameOf(true, PlaybackStateBytes(state)));
    Write();
  }
  // If the viewer is slow, only the latest time is sent.
  void SendTime(int64_t time_ns) {
    time_ = time_ns;
    Write();
  }

  void Send(const Message& message) {
    for (const auto& [id, channel] : subscriptions_) {
      if (channel == message.topic) Enqueue(id, message);
    }
  }

  void Forget(const std::vector<size_t>& channels) {
    std::erase_if(subscriptions_, [&](const auto& subscription) {
      return std::ranges::find(channels, subscription.second) != channels.end();
    });
  }

 private:
  static Frame FrameOf(bool is_binary, std::string bytes) {
    return {is_binary, std::make_shared<const std::string>(std::move(bytes))};
  }

  void OnOpen() override {
    core_->viewers.insert(this);
    core_->num_viewers = static_cast<int>(core_->viewers.size());
    const Options& server = core_->options;
    SendText(
        ServerInfoText(server.name, server.session, has_playback_ ? server.playback_end_ns : std::nullopt));
    if (!core_->topics.empty()) SendText(AdvertiseText(core_->topics, 0));
    if (!core_->gone.empty()) SendText(UnadvertiseText({core_->gone.begin(), core_->gone.end()}));
    if (core_->playback) SendPlayback(*core_->playback);
  }

  void Enqueue(uint32_t id, const Message& message) {
    queue_.push_back(MessageBytes(id, message.time_ns, *message.json));
    queue_bytes_ += queue_.back().size();
    const int64_t before = dropped_;
    while (queue_.size() > 1 && (queue_bytes_ > kQueueBytes || queue_.size() > kQueueMessages)) {
      queue_bytes_ -= queue_.front().size();
      queue_.pop_front();
      ++dropped_;
    }
    if (before == 0 && dropped_ > 0) {
      SendText(WarningText("dropped", "this viewer reads too slowly: the oldest messages are dropped"));
    }
    Write();
  }

  std::optional<Frame> NextFrame() override {
    if (!control_.empty()) {
      Frame frame = std::move(control_.front());
      control_.pop_front();
      return frame;
    }
    if (!queue_.empty()) {
      queue_bytes_ -= queue_.front().size();
      Frame frame = FrameOf(true, std::move(queue_.front()));
      queue_.pop_front();
      return frame;
    }
    if (!time_) return std::nullopt;
    return FrameOf(true, TimeBytes(*std::exchange(time_, std::nullopt)));
  }

  bool OnMessage(std::string_view bytes, bool is_text) override {
    return is_text ? ReceiveText(bytes) : ReceiveBinary(bytes);
  }

  bool ReceiveText(std::string_view text) {
    const auto client = ParseClientText(text);
    if (!client) return false;
    for (const uint32_t id : client->unsubscribe) subscriptions_.erase(id);
    for (const auto& [id, channel] : client->subscribe) {
      if (channel >= core_->topics.size() || core_->gone.contains(channel)) continue;
      if (subscriptions_.size() > core_->topics.size()) return false;  // more than one per topic
      subscriptions_[id] = channel;
      const auto last = core_->kept.find(channel);
      if (last != core_->kept.end()) Enqueue(id, last->second);
    }
    return true;
  }

  bool ReceiveBinary(std::string_view bytes) {
    // Other message types belong to capabilities that this server does not offer.
    if (bytes.empty()) return false;
    if (bytes[0] != '\x03') return true;
    const auto control = ParsePlaybackControl(bytes);
    if (!control) return false;
    if (has_playback_ && core_->options.on_control) core_->options.on_control(*control);
    return true;
  }

  Core* const core_;
  std::map<uint32_t, size_t> subscriptions_;
  std::deque<Frame> control_;
  std::deque<std::string> queue_;
  size_t queue_bytes_ = 0;
  std::optional<int64_t> time_;
  int64_t dropped_ = 0;
  bool has_playback_ = false;
};

// Handles a connection until it becomes a viewer or is rejected.
class FoxgloveServer::Core::Handshake : public std::enable_shared_from_this<Handshake> {
 public:
  Handshake(Core* core, tcp::socket socket) : core_(core), stream_(std::move(socket)) {
    parser_.header_limit(kMaxHeader);
  }

  void Read() {
    stream_.expires_after(kTimeout);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](error_code error, size_t) {
      if (error) return;
      const std::string refusal = self->core_->Refusal(self->parser_.get());
      if (!refusal.empty()) return self->Refuse(refusal);
      std::make_shared<Viewer>(self->core_, std::move(self->stream_))->Start(self->parser_.get());
    });
  }

 private:
  void Refuse(const std::string& why) {
    response_.result(http::status::bad_request);
    response_.set(http::field::content_type, "text/plain; charset=utf-8");
    response_.keep_alive(false);
    response_.body() = why + "\n";
    response_.prepare_payload();
    stream_.expires_after(kTimeout);
    http::async_write(stream_, response_, [self = shared_from_this()](error_code, size_t) {
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  Core* const core_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{2 * kMaxHeader};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

std::string FoxgloveServer::Core::Refusal(const http::request<http::empty_body>& request) {
  const std::string_view host = View(request[http::field::host]);
  if (request.count(http::field::host) != 1) return "exactly one Host header is required";
  if (is_loopback && !viz::IsLoopbackHost(host)) return "unknown Host name";
  if (!websocket::is_upgrade(request))
    return "this is a WebSocket server for Foxglove: open ws://" + std::string(host);
  const std::string origin(View(request[http::field::origin]));
  const bool is_allowed = origin.empty() || origin == kFoxgloveOrigin || viz::IsOwnOrigin(origin, host) ||
                          std::ranges::find(options.origins, origin) != options.origins.end();
  if (request.count(http::field::origin) > 1 || !is_allowed) {
    if (options.on_refused) {
      options.on_refused(fmt::format("refused a page from {0}; allow it with --allow-origin {0}", origin));
    }
    return "requests from other origins are refused";
  }
  if (ChooseSubprotocol(View(request[http::field::sec_websocket_protocol])).empty()) {
    return "the subprotocol foxglove.sdk.v1 or foxglove.websocket.v1 is required";
  }
  if (viewers.size() >= kViewers) return "too many viewers";
  return "";
}

void FoxgloveServer::Core::Listen() {
  error_code error;
  const auto address = asio::ip::make_address(options.host, error);
  if (error) throw InputError(fmt::format("--listen {}: expected an IP address", options.host));
  const tcp::endpoint endpoint(address, options.port);
  is_loopback = address.is_loopback();
  listener.Listen(endpoint, options.host);
}

FoxgloveServer::FoxgloveServer(const Options& options) : core_(std::make_unique<Core>(options)) {
  core_->Listen();
}

void FoxgloveServer::Start() {
  core_->listener.Start([core = core_.get()](tcp::socket socket) {
    std::make_shared<Core::Handshake>(core, std::move(socket))->Read();
  });
}

FoxgloveServer::~FoxgloveServer() { core_->listener.Stop(); }

uint16_t FoxgloveServer::port() const { return core_->listener.port(); }
int FoxgloveServer::viewers() const { return core_->num_viewers; }

void FoxgloveServer::SetTopics(const std::vector<Topic>& topics) {
  asio::post(core_->listener.context(), [core = core_.get(), topics] {
    const size_t from = core->topics.size();
    std::vector<size_t> gone;
    for (size_t id = from; id < topics.size(); ++id) {
      for (size_t old = 0; old < from; ++old) {
        if (topics[old].name == topics[id].name && core->gone.insert(old).second) gone.push_back(old);
      }
    }
    core->topics = topics;
    for (const size_t id : gone) core->kept.erase(id);
    for (Core::Viewer* viewer : core->viewers) {
      viewer->Forget(gone);
      if (!gone.empty()) viewer->SendText(UnadvertiseText(gone));
      viewer->SendText(AdvertiseText(topics, from));
    }
  });
}

void FoxgloveServer::Send(const Message& message) {
  asio::post(core_->listener.context(), [core = core_.get(), message] {
    core->kept[message.topic] = message;
    for (Core::Viewer* viewer : core->viewers) viewer->Send(message);
  });
}

void FoxgloveServer::Forget() {
  asio::post(core_->listener.context(), [core = core_.get()] { core->kept.clear(); });
}

void FoxgloveServer::SendTime(int64_t time_ns) {
  asio::post(core_->listener.context(), [core = core_.get(), time_ns] {
    for (Core::Viewer* viewer : core->viewers) viewer->SendTime(time_ns);
  });
}

void FoxgloveServer::SendPlayback(const PlaybackState& state) {
  asio::post(core_->listener.context(), [core = core_.get(), state] {
    core->playback = state;
    core->playback->did_seek = false;
    core->playback->request_id.clear();
    for (Core::Viewer* viewer : core->viewers) viewer->SendPlayback(state);
  });
}

}  // namespace evalbus::exports
