#include "viz/web/server.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <list>
#include <optional>
#include <set>
#include <utility>

#include "base/errors.h"
#include "viz/web/listener.h"
#include "viz/web/websocket_session.h"

namespace evalbus::viz {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::steady_clock;

constexpr uint32_t kMaxHeader = 8192;
constexpr size_t kMaxMessage = 8192;

// Generates a token of 128 random bits.
std::string DrawToken() {
  std::array<uint8_t, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw EnvironmentError("cannot generate a random token");
  }
  std::string token;
  for (const uint8_t byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

// Token bucket: allows a burst of `at_once`, and `per_s` per second after that.
class Allowance {
 public:
  Allowance(int at_once, int per_s) : most_(at_once), per_s_(per_s), left_(at_once) {}
  bool Take() {
    const auto now = steady_clock::now();
    left_ = std::min(most_, left_ + per_s_ * std::chrono::duration<double>(now - last_).count());
    last_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  double most_, per_s_, left_;
  steady_clock::time_point last_ = steady_clock::now();
};

std::string_view View(boost::beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

WebAnswer WebAnswer::Text(int status, const std::string& text) {
  WebAnswer answer;
  answer.status = status;
  answer.body = std::make_shared<const std::string>(text + "\n");
  return answer;
}

// Except for wake_is_posted and listener, members are changed only on the server's thread or before it
// starts.
struct WebServer::Core {
  class Connection;
  class ViewerSession;

  Core(Address the_address, std::shared_ptr<UpdateBroadcaster> the_broadcaster, Limits the_limits)
      : address(std::move(the_address)), broadcaster(std::move(the_broadcaster)), limits(the_limits) {}

  void Listen();
  void Take(tcp::socket socket);
  void WakeViewers();
  bool IsAllowedHost(std::string_view asked) const { return !token.empty() || IsLoopbackHost(asked); }
  std::string host() const { return address.host.empty() ? "127.0.0.1" : address.host; }

  const Address address;
  const std::shared_ptr<UpdateBroadcaster> broadcaster;
  const Limits limits;
  std::string token;
  bool is_ipv6 = false, is_any = false, is_loopback = true;
  Handler handler;
  NoteHandler on_note;
  VerdictHandler on_verdict;
  int connections = 0;
  // Connections that wait for their client. The connection that has made no progress for the longest time is
  // in front.
  std::list<Connection*> waiting;
  std::set<ViewerSession*> viewers;
  std::atomic<bool> wake_is_posted{false};
  // Declared last, so that the listener and its connections are destroyed before the members that they use.
  Listener listener;
};

// A viewer of the page. The next block is selected only when the previous block has been sent.
class WebServer::Core::ViewerSession : public WebSocketSession {
 public:
  ViewerSession(Core* core, beast::tcp_stream stream)
      : WebSocketSession(std::move(stream), {core->limits.timeout, core->limits.viewer_timeout, kMaxMessage}),
        core_(core),
        allowance_(core_->limits.messages, core_->limits.messages_per_s) {}
  ~ViewerSession() override {
    if (entered_) core_->broadcaster->Leave(&viewer_);
    core_->viewers.erase(this);
    --core_->connections;
  }

  void Start(const Request& request) {
    core_->viewers.insert(this);
    Accept(request);
  }

 private:
  void OnOpen() override {
    core_->broadcaster->Enter(&viewer_);
    entered_ = true;
  }

  bool OnMessage(std::string_view bytes, bool) override {
    if (!allowance_.Take()) return false;
    if (const auto run = ParseWatch(bytes)) {
      core_->broadcaster->Watch(&viewer_, *run);  // unknown runs are ignored
      return true;
    }
    if (std::optional<WebNote> note = core_->on_note ? ParseNote(bytes) : std::nullopt) {
      core_->on_note(std::move(*note));
      return true;
    }
    std::optional<WebVerdict> verdict = core_->on_verdict ? ParseVerdict(bytes) : std::nullopt;
    if (!verdict) return false;
    core_->on_verdict(std::move(*verdict));
    return true;
  }

  std::optional<Frame> NextFrame() override {
    SharedBytes block = core_->broadcaster->Next(&viewer_);
    if (!block) return std::nullopt;
    return Frame{.is_binary = true, .bytes = std::move(block)};
  }

  Core* const core_;
  UpdateBroadcaster::Viewer viewer_;
  Allowance allowance_;
  bool entered_ = false;
};

// An HTTP connection, which handles one request at a time.
class WebServer::Core::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Core* core, tcp::socket socket)
      : core_(core),
        stream_(std::move(socket)),
        allowance_(core_->limits.requests, core_->limits.requests_per_s) {
    ++core_->connections;
  }
  ~Connection() {
    EndWait();
    if (!became_viewer_) --core_->connections;
  }

  void Read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    BeginWait(std::exchange(is_first_, false) ? core_->limits.first_request : core_->limits.timeout);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, size_t) {
      self->EndWait();
      if (!error) return self->Answer();
      if (error == http::error::header_limit || error == http::error::buffer_overflow) {
        return self->Refuse(431, "the request is too long");
      }
      if (error == http::error::unexpected_body || error == http::error::body_limit) {
        return self->Refuse(413, "requests must not have a body");
      }
      const bool is_of_http = error.category() == make_error_code(http::error::bad_method).category();
      if (!is_of_http || error == http::error::end_of_stream || error == http::error::partial_message) {
        return self->Close();
      }
      self->Refuse(400, "not an HTTP request");
    });
  }

  // Closes a connection that waits for its client.
  void Drop() {
    EndWait();
    stream_.close();
  }

 private:
  // Starts the timeout of the client.
  void BeginWait(std::chrono::seconds timeout) {
    EndWait();
    stream_.expires_after(timeout);
    waiting_ = core_->waiting.insert(core_->waiting.end(), this);
  }
  void EndWait() {
    if (waiting_) core_->waiting.erase(*waiting_);
    waiting_.reset();
  }

  void Answer() {
    const auto& request = parser_->get();
    keep_alive_ = request.keep_alive();
    is_head_ = request.method() == http::verb::head;
    const std::string_view host = View(request[http::field::host]);
    if (request.count(http::field::host) != 1) return Refuse(400, "exactly one Host header is required");
    if (!core_->IsAllowedHost(host)) return Refuse(403, "unknown Host name");
    if (!is_head_ && request.method() != http::verb::get)
      return Refuse(405, "only GET and HEAD are supported");
    if (!allowance_.Take()) return Refuse(429, "too many requests");
    const WebTarget target = ParseTarget(View(request.target()), core_->token);
    if (target.kind == WebTarget::Kind::kNone) return Send(WebAnswer::Text(404, "not found"));
    if (target.kind == WebTarget::Kind::kLive) return BecomeViewer();
    host_ = std::string(host);
    stream_.expires_never();  // the handler may need longer than this timeout
    core_->handler(target, [self = shared_from_this()](WebAnswer answer) {
      asio::post(self->core_->listener.context(),
                 [self, moved = std::move(answer)]() mutable { self->Send(std::move(moved)); });
    });
  }

  void BecomeViewer() {
    const auto& request = parser_->get();
    if (!websocket::is_upgrade(request)) return Refuse(426, "this path is for WebSocket connections");
    // A WebSocket request without Origin does not come from a browser. It can only come from a program on
    // this machine or from a client that has the token.
    if (request.count(http::field::origin) > 1 ||
        !IsOwnOrigin(View(request[http::field::origin]), View(request[http::field::host]))) {
      return Refuse(403, "requests from other origins are refused");
    }
    if (core_->viewers.size() >= static_cast<size_t>(core_->limits.viewers)) {
      return Refuse(503, "too many viewers");
    }
    became_viewer_ = true;
    std::make_shared<ViewerSession>(core_, std::move(stream_))->Start(request);
  }

  void Refuse(int status, const std::string& why) {
    keep_alive_ = false;
    Send(WebAnswer::Text(status, why));
  }

  void Send(WebAnswer answer) {
    answer_ = std::move(answer);
    const size_t length = answer_.body ? answer_.body->size() : 0;
    const auto reason = http::obsolete_reason(static_cast<http::status>(answer_.status));
    head_ = fmt::format(
        "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: {}\r\nCache-Control: {}\r\n"
        "X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n"
        "Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n"
        "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' "
        "blob: "
        "data:; connect-src 'self'{}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\r\n",
        answer_.status, std::string_view(reason.data(), reason.size()), answer_.type, length,
        keep_alive_ ? "keep-alive" : "close",
        answer_.is_forever ? "private, max-age=31536000, immutable" : "no-store", SocketSource());
    left_ = {asio::buffer(head_), asio::const_buffer()};
    if (!is_head_ && length > 0) left_[1] = asio::buffer(*answer_.body);
    Write();
  }

  // Writes the remaining part of the response as fast as the client reads it.
  void Write() {
    BeginWait(core_->limits.timeout);
    stream_.async_write_some(left_, [self = shared_from_this()](error_code error, size_t written) {
      self->EndWait();
      for (asio::const_buffer& part : self->left_) {
        const size_t taken = std::min(written, part.size());
        part += taken;
        written -= taken;
      }
      if (!error && asio::buffer_size(self->left_) > 0) return self->Write();
      self->answer_ = {};
      if (error || !self->keep_alive_) return self->Close();
      self->Read();
    });
  }

  // Some browsers do not include same-origin WebSockets in 'self'. The Host is copied into the header only if
  // it consists of safe characters.
  std::string SocketSource() const {
    const auto is_plain = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
             c == '-' || c == ':' || c == '[' || c == ']';
    };
    return !host_.empty() && std::ranges::all_of(host_, is_plain) ? " ws://" + host_ : "";
  }

  void Close() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Core* const core_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{2 * kMaxHeader};
  std::optional<http::request_parser<http::empty_body>> parser_;
  Allowance allowance_;
  std::string head_, host_;
  WebAnswer answer_;
  std::array<asio::const_buffer, 2> left_;
  // Position in Core::waiting.
  std::optional<std::list<Connection*>::iterator> waiting_;
  bool is_first_ = true, keep_alive_ = false, is_head_ = false, became_viewer_ = false;
};

void WebServer::Core::Listen() {
  error_code error;
  tcp::resolver resolver(listener.context());
  const auto found = resolver.resolve(host(), std::to_string(address.port), tcp::resolver::passive, error);
  if (error || found.empty()) {
    throw InputError(fmt::format("--listen {}: no such address ({})", address.host, error.message()));
  }
  const tcp::endpoint endpoint = found.begin()->endpoint();
  is_ipv6 = endpoint.address().is_v6();
  is_any = endpoint.address().is_unspecified();
  is_loopback = endpoint.address().is_loopback();
  if (!address.host.empty()) token = DrawToken();
  listener.Listen(endpoint, host());
}

void WebServer::Core::Take(tcp::socket socket) {
  if (connections >= limits.connections) {
    // Viewers and connections whose responses are being generated are not dropped.
    if (waiting.empty()) return;
    waiting.front()->Drop();
  }
  std::make_shared<Connection>(this, std::move(socket))->Read();
}

void WebServer::Core::WakeViewers() {
  wake_is_posted = false;
  for (ViewerSession* viewer : viewers) viewer->Write();
}

WebServer::WebServer(const Address& address, std::shared_ptr<UpdateBroadcaster> broadcaster,
                     const Limits& limits)
    : core_(std::make_unique<Core>(address, std::move(broadcaster), limits)) {
  core_->Listen();
}

WebServer::WebServer(const Address& address, std::shared_ptr<UpdateBroadcaster> broadcaster)
    : WebServer(address, std::move(broadcaster), Limits()) {}

WebServer::WebServer(int descriptor, std::shared_ptr<UpdateBroadcaster> broadcaster)
    : core_(std::make_unique<Core>(Address(), std::move(broadcaster), Limits())) {
  core_->listener.Adopt(descriptor);
}

WebServer::~WebServer() { Stop(); }

void WebServer::Stop() { core_->listener.Stop(); }

uint16_t WebServer::port() const { return core_->listener.port(); }
int WebServer::descriptor() const { return core_->listener.descriptor(); }
const std::string& WebServer::token() const { return core_->token; }

std::string WebServer::url() const {
  error_code ignored;
  const std::string host = core_->is_any ? asio::ip::host_name(ignored) : core_->host();
  const bool in_brackets = core_->is_ipv6 && host.find(':') != host.npos;
  return fmt::format("http://{}:{}/{}", in_brackets ? "[" + host + "]" : host, port(),
                     core_->token.empty() ? "" : core_->token + "/");
}

bool WebServer::is_loopback() const { return core_->is_loopback; }

void WebServer::Start(Handler handler, NoteHandler on_note, VerdictHandler on_verdict) {
  core_->handler = std::move(handler);
  core_->on_note = std::move(on_note);
  core_->on_verdict = std::move(on_verdict);
  core_->listener.Start([core = core_.get()](tcp::socket socket) { core->Take(std::move(socket)); });
}

void WebServer::Wake() {
  if (core_->wake_is_posted.exchange(true)) return;
  asio::post(core_->listener.context(), [core = core_.get()] { core->WakeViewers(); });
}

}  // namespace evalbus::viz
