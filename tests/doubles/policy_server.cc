#include "tests/doubles/policy_server.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "base/overloaded.h"
#include "policy_bridge/wire/codecs.h"

namespace evalbus::policy {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

}  // namespace

// What the server has received; kept across restarts.
struct PolicyServerDouble::Seen {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Value> requests;
  std::vector<Handshake> handshakes;
  size_t num_open = 0, num_pongs = 0, num_goodbyes = 0;

  template <class Change>
  void Note(const Change& change) {
    {
      const std::lock_guard lock(mutex);
      change();
    }
    changed.notify_all();
  }
};

struct PolicyServerDouble::Session : std::enable_shared_from_this<Session> {
  Session(tcp::socket socket, const Options& its_options, Seen* its_seen)
      : options(its_options), seen(its_seen), stream(std::move(socket)) {}
  ~Session() { SetOpen(false); }

  void Begin() {
    http::async_read(stream.next_layer(), buffer, request,
                     [self = shared_from_this()](error_code error, size_t) {
                       if (!error) self->Accept();
                     });
  }

  void Accept() {
    const auto field = [&](auto name) { return std::string(request[name]); };
    seen->Note([&] {
      seen->handshakes.push_back({field(http::field::host), std::string(request.target()),
                                  field(http::field::authorization),
                                  field(http::field::sec_websocket_extensions)});
    });
    if (options.http_status < 0) return Begin();  // waits for another request or the end of the connection
    if (options.http_status == 0) return WriteRaw({{0xff, 0, 0, 0, 0, 0, 0, 0, 1, 0x7f}, true});
    if (options.http_status != 101) {
      refusal.result(static_cast<http::status>(options.http_status));
      refusal.prepare_payload();
      http::async_write(stream.next_layer(), refusal,
                        [self = shared_from_this()](error_code, size_t) { self->Drop(); });
      return;
    }
    stream.read_message_max(0);
    stream.control_callback([this](websocket::frame_type type, auto) {
      if (type == websocket::frame_type::pong) seen->Note([&] { ++seen->num_pongs; });
    });
    stream.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->SetOpen(true);
      const bool client_begins =
          self->options.wire == Wire::kVlaEval || self->options.wire == Wire::kXPolicyLab;
      if (!client_begins) return self->Give(self->options.greeting, 0, "");
      self->Read();
    });
  }

  void Read() {
    stream.async_read(buffer, [self = shared_from_this()](error_code error, size_t) {
      self->is_reading = false;
      if (error == websocket::error::closed) self->seen->Note([&] { ++self->seen->num_goodbyes; });
      if (error) return self->SetOpen(false);
      const auto* bytes = static_cast<const uint8_t*>(self->buffer.data().data());
      const Value message = DecodeMsgpack({bytes, self->buffer.size()});
      self->buffer.consume(self->buffer.size());
      if (self->options.keeps_requests) {
        self->seen->Note([&] { self->seen->requests.push_back(message); });
      }
      self->Take(message);
    });
    is_reading = true;
    while (!waiting.empty()) {
      waiting.front()();
      waiting.pop_front();
    }
  }

  void Take(const Value& message) {
    if (options.wire == Wire::kOpenpi) return Give(options.answer(message), 0, "");
    if (options.wire == Wire::kRoboArena) {
      if (*message.Find("endpoint") == Value("reset")) return Give(options.reset, 0, "");
      Map observation = *message.As<Map>();
      std::erase_if(observation, [](const auto& entry) { return entry.first == "endpoint"; });
      return Give(options.answer(observation), 0, "");
    }
    if (options.wire == Wire::kXPolicyLab) return TakeXPolicyLab(message);
    const std::string& type = *message.Find("type")->As<std::string>();
    const int64_t seq = *message.Find("seq")->As<int64_t>();
    if (type == "hello") return Give(options.greeting, seq, "hello");
    if (type == "episode_start") return Give(options.episode_start, seq, "");
    if (type == "episode_end") return Read();
    Give(options.answer(*message.Find("payload")), seq, "action");
  }

  void TakeXPolicyLab(const Value& message) {
    const std::string& type = *message.Find("message_type")->As<std::string>();
    message_id = *message.Find("message_id");
    if (type == "hello") return Give(options.greeting, 0, "hello_ack");
    if (type == "infer") {
      return Give(options.answer(*message.Find("payload")->Find("observation")), 0, "infer_result");
    }
    if (type == "close") return GiveClose({1000, ""});
    Give(options.control(type), 0, type + (type == "reset" ? "_result" : "_ack"));
  }

  // `type` is the message type in the envelope that vla-eval and XPolicyLab put around a Value.
  void Give(const Answer& answer, int64_t seq, const std::string& type) {
    std::visit(Overloaded{
                   [&](const Value& value) { GiveValue(value, seq, type); },
                   [&](const Nothing&) { Read(); },
                   [&](const Text& text) { Write(text.text, true, false); },
                   [&](const Error& error) {
                     if (options.wire == Wire::kXPolicyLab) {
                       return GiveValue(
                           Map{{"code", error.code}, {"message", error.text}, {"details", Map{}}}, 0,
                           "error");
                     }
                     if (options.wire != Wire::kVlaEval) return Write(error.text, true, true);
                     GiveValue(Map{{"error", error.text}}, seq, "error");
                   },
                   [&](const Message& message) {
                     Write({message.bytes.begin(), message.bytes.end()}, false, false);
                   },
                   [&](const Raw& raw) { WriteRaw(raw); },
                   [&](const Close& close) { GiveClose(close); },
               },
               answer);
  }

  void GiveValue(const Value& value, int64_t seq, const std::string& type) {
    const bool is_vla_eval = options.wire == Wire::kVlaEval;
    Value message = value;
    if (is_vla_eval) {
      Map payload = *value.As<Map>();
      if (type == "hello" && !value.Find("protocol_version")) payload.emplace_back("protocol_version", 1);
      message = Map{{"type", type}, {"payload", std::move(payload)}, {"seq", seq}, {"timestamp", 0.0}};
    }
    ArrayKeys array_keys = is_vla_eval ? ArrayKeys::kTexts : ArrayKeys::kBytes;
    if (options.wire == Wire::kXPolicyLab) {
      message = Map{{"message_type", type},     {"evaluation_id", "any"}, {"trial_id", nullptr}, {"step", 0},
                    {"message_id", message_id}, {"payload", value}};
      array_keys = ArrayKeys::kMsgpackNumpy;
    }
    const Bytes bytes = EncodeMsgpack(message, array_keys);
    Write({bytes.begin(), bytes.end()}, false, false);
  }

  void Write(std::string bytes, bool is_text, bool is_last) {
    outgoing = std::move(bytes);
    stream.text(is_text);
    stream.async_write(
        asio::buffer(outgoing), [self = shared_from_this(), is_last](error_code error, size_t) {
          if (error) return self->SetOpen(false);
          if (!is_last) return self->Read();
          self->GiveClose({1011, "Internal server error. Traceback included in previous frame."});
        });
  }

  // Runs `act` immediately if a read is pending, because then no write is pending; otherwise queues it until
  // the next read is pending.
  void WhenReading(std::function<void()> act) { is_reading ? act() : waiting.push_back(std::move(act)); }

  void SendUnrequested(const std::string& message, bool is_text) {
    const auto held = std::make_shared<std::string>(message);
    stream.text(is_text);
    stream.async_write(asio::buffer(*held), [self = shared_from_this(), held](error_code, size_t) {});
  }

  void Ping() {
    stream.async_ping({}, [self = shared_from_this()](error_code) {});
  }

  void WriteRaw(const Raw& raw) {
    outgoing.assign(raw.bytes.begin(), raw.bytes.end());
    asio::async_write(stream.next_layer(), asio::buffer(outgoing),
                      [self = shared_from_this(), gone = raw.then_gone](error_code, size_t) {
                        gone ? self->Drop() : self->Read();
                      });
  }

  void GiveClose(const Close& close) {
    stream.async_close({static_cast<websocket::close_code>(close.code), close.reason},
                       [self = shared_from_this()](error_code) { self->SetOpen(false); });
  }

  void Drop() {
    error_code ignored;
    stream.next_layer().close(ignored);
    SetOpen(false);
  }

  void SetOpen(bool open) {
    if (open == is_open) return;
    is_open = open;
    seen->Note([&] { open ? ++seen->num_open : --seen->num_open; });
  }

  const Options& options;
  Seen* const seen;
  websocket::stream<tcp::socket> stream;
  boost::beast::flat_buffer buffer;
  http::request<http::string_body> request;
  http::response<http::string_body> refusal;
  std::string outgoing;
  Value message_id;  // id of XPolicyLab's last request
  bool is_open = false, is_reading = false;
  std::deque<std::function<void()>> waiting;
};

struct PolicyServerDouble::Server {
  Server(const Options& its_options, Seen* its_seen, int port)
      : options(its_options),
        seen(its_seen),
        acceptor(context, tcp::endpoint(asio::ip::address_v4::loopback(), static_cast<uint16_t>(port))) {
    Accept();
    thread = std::thread([this] { context.run(); });
  }
  ~Server() {
    context.stop();
    thread.join();
  }

  void Accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error) return;
      const auto session = std::make_shared<Session>(std::move(socket), options, seen);
      sessions.push_back(session);
      session->Begin();
      Accept();
    });
  }

  // Calls `function` with every open connection, on the server's thread.
  template <class Function>
  void ForEach(const Function& function) {
    asio::post(context, [this, function] {
      for (const std::weak_ptr<Session>& weak : sessions) {
        const auto session = weak.lock();
        if (session && session->is_open) function(session);
      }
    });
  }

  const Options& options;
  Seen* const seen;
  asio::io_context context{1};
  tcp::acceptor acceptor;
  std::vector<std::weak_ptr<Session>> sessions;
  std::thread thread;
};

PolicyServerDouble::PolicyServerDouble(Options options)
    : options_(std::move(options)), seen_(std::make_unique<Seen>()) {
  Start();
}

PolicyServerDouble::~PolicyServerDouble() { Stop(); }

void PolicyServerDouble::Start() {
  server_ = std::make_unique<Server>(options_, seen_.get(), port_);
  port_ = server_->acceptor.local_endpoint().port();
}

void PolicyServerDouble::Stop() { server_.reset(); }

std::vector<Value> PolicyServerDouble::Requests() const {
  const std::lock_guard lock(seen_->mutex);
  return seen_->requests;
}

std::vector<PolicyServerDouble::Handshake> PolicyServerDouble::Handshakes() const {
  const std::lock_guard lock(seen_->mutex);
  return seen_->handshakes;
}

size_t PolicyServerDouble::Goodbyes() const {
  const std::lock_guard lock(seen_->mutex);
  return seen_->num_goodbyes;
}

bool PolicyServerDouble::Ping(std::chrono::seconds limit) {
  std::unique_lock lock(seen_->mutex);
  const size_t expected = seen_->num_pongs + seen_->num_open;
  lock.unlock();
  server_->ForEach([](const std::shared_ptr<Session>& session) {
    session->WhenReading([its = session.get()] { its->Ping(); });
  });
  lock.lock();
  const bool answered = seen_->changed.wait_for(lock, limit, [&] { return seen_->num_pongs >= expected; });
  lock.unlock();
  if (!answered) server_->ForEach([](const std::shared_ptr<Session>& session) { session->Drop(); });
  return answered;
}

void PolicyServerDouble::SendUnrequested(const std::string& message, bool is_text) {
  server_->ForEach([=](const std::shared_ptr<Session>& session) {
    session->WhenReading([=, its = session.get()] { its->SendUnrequested(message, is_text); });
  });
}

bool PolicyServerDouble::WaitForConnections(size_t count, std::chrono::seconds limit) {
  std::unique_lock lock(seen_->mutex);
  return seen_->changed.wait_for(lock, limit, [&] { return seen_->num_open == count; });
}

}  // namespace evalbus::policy
