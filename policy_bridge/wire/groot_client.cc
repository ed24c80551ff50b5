#include "policy_bridge/wire/groot_client.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>
#include <zmq.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "policy_bridge/wire/groot_codec.h"
#include "policy_bridge/wire/server_words.h"
#include "policy_bridge/wire/url.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;
using Dialect = ClientOptions::GrootDialect;
using Clock = std::chrono::steady_clock;

Clock::time_point In(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

// A socket for requests, and one that tells what becomes of its connection.
struct Sockets {
  explicit Sockets(zmq::context_t& context)
      : requests(context, zmq::socket_type::req), events(context, zmq::socket_type::pair) {}
  // An event that nobody takes any more would hold up ZeroMQ's thread for ever, and with it all later
  // connections.
  ~Sockets() { zmq_socket_monitor(requests.handle(), nullptr, 0); }

  zmq::socket_t requests, events;
};

// One connection, which is not made again when it is lost: a request without one would wait for its deadline.
class Connection {
 public:
  // Throws ServerError if there is none within limit_s.
  Connection(zmq::context_t& context, int number, const ClientOptions& options)
      : url_(options.url), sockets_(context) {
    sockets_.requests.set(zmq::sockopt::linger, 0);
    sockets_.requests.set(zmq::sockopt::ipv6, true);
    sockets_.requests.set(zmq::sockopt::reconnect_ivl, -1);
    sockets_.requests.set(zmq::sockopt::maxmsgsize, static_cast<int64_t>(options.max_reply_bytes));
    sockets_.events.set(zmq::sockopt::linger, 0);
    const std::string name = fmt::format("inproc://events-{}", number);
    constexpr int kEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                            ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                            ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED;
    if (zmq_socket_monitor(sockets_.requests.handle(), name.c_str(), kEvents) != 0) throw zmq::error_t();
    sockets_.events.connect(name);
    try {
      sockets_.requests.connect(url_);
    } catch (const zmq::error_t& error) {
      throw ServerError(Kind::kUnreachable, fmt::format("{}: {}", url_, error.what()));
    }
    if (!Wait(In(options.connect_s))) {
      throw ServerError(Kind::kTimeout, fmt::format("{}: no connection in {} s", url_, options.connect_s));
    }
    switch (NextEvent()) {
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        return;
      case ZMQ_EVENT_CLOSED:
        throw ServerError(Kind::kUnreachable, url_ + ": no server there");
      default:
        throw ServerError(Kind::kProtocol, url_ + ": something else than a ZeroMQ server answers there");
    }
  }

  // One frame there, one frame back.
  Bytes Ask(const Bytes& request, double limit_s, uint64_t max_reply_bytes) {
    const Clock::time_point deadline = In(limit_s);
    if (!sockets_.requests.send(zmq::buffer(request), zmq::send_flags::dontwait)) Lost();
    zmq::message_t reply;
    while (true) {
      if (!Wait(deadline)) {
        throw ServerError(Kind::kTimeout, fmt::format("{}: no answer in {} s", url_, limit_s));
      }
      // Before the events: the last that a server says as it goes counts.
      if (sockets_.requests.recv(reply, zmq::recv_flags::dontwait)) break;
      if (NextEvent() != 0) {
        Lost(fmt::format("without an answer, or one of more than {} bytes was coming", max_reply_bytes));
      }
    }
    if (reply.more()) throw ServerError(Kind::kProtocol, url_ + ": an answer of several frames");
    const auto* begin = reply.data<uint8_t>();
    return {begin, begin + reply.size()};
  }

 private:
  [[noreturn]] void Lost(const std::string& how = "before a request") const {
    throw ServerError(Kind::kUnreachable, fmt::format("{}: the connection ended {}", url_, how));
  }

  // Until there is an answer or an event; false: neither by the deadline.
  bool Wait(Clock::time_point deadline) {
    while (true) {
      std::array<zmq::pollitem_t, 2> items = {
          {{sockets_.requests.handle(), 0, ZMQ_POLLIN, 0}, {sockets_.events.handle(), 0, ZMQ_POLLIN, 0}}};
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
      try {
        if (zmq::poll(items.data(), items.size(), std::max(left, std::chrono::milliseconds(0))) > 0)
          return true;
        if (Clock::now() >= deadline) return false;
      } catch (const zmq::error_t& error) {
        if (error.num() != EINTR) throw;
      }
    }
  }

  // 0: none has come.
  int NextEvent() {
    zmq::message_t event, address;
    if (!sockets_.events.recv(event, zmq::recv_flags::dontwait) || event.size() < sizeof(uint16_t)) return 0;
    if (event.more()) std::ignore = sockets_.events.recv(address, zmq::recv_flags::none);
    uint16_t number = 0;
    std::memcpy(&number, event.data(), sizeof number);
    return number;
  }

  std::string url_;
  Sockets sockets_;
};

constexpr std::string_view kVideo = "video.", kState = "state.", kAction = "action.";

// (...) -> (1, ...).
Array Batched(Array array) {
  array.shape.insert(array.shape.begin(), 1);
  return array;
}

// An observation's entry as all dialects have it, but for its batch.
Value Checked(const std::string& key, const Value& value) {
  const Array* array = value.As<Array>();
  if (key.starts_with(kVideo)) {
    if (!array || array->dtype != "|u1" || array->shape.size() != 4 || array->shape[3] != 3) {
      throw InputError(fmt::format("observation {}: {}, but GR00T takes |u1 [frames, height, width, 3]", key,
                                   Describe(value)));
    }
    return value;
  }
  if (key.starts_with(kState)) {
    if (!array || array->shape.size() != 2 || ItemSize(array->dtype) == 0) {
      throw InputError(
          fmt::format("observation {}: {}, but GR00T takes <f4 [times, length]", key, Describe(value)));
    }
    return array->dtype == "<f4" ? *array : FloatArray(Numbers(*array), array->shape);
  }
  if (!value.Is<std::string>()) {
    throw InputError(
        fmt::format("observation {}: {}, but GR00T takes \"video.NAME\", \"state.NAME\" and texts", key,
                    Describe(value)));
  }
  return value;
}

class GrootClient : public PolicyClient {
 public:
  explicit GrootClient(const ClientOptions& options) : options_(options), dialect_(options.groot_dialect) {
    if (!ParseUrl(options.url, "tcp").target.empty()) {
      throw InputError(Printable(options.url) + ": a GR00T server's address ends with its port");
    }
  }

  Value Connect() override {
    connection_.reset();
    try {
      connection_.emplace(context_, ++num_connections_, options_);
      answered_ = false;
      horizon_.reset();
      dialect_ = options_.groot_dialect;
      CheckMap("ping", Ask("ping", {}, options_.reply_s));
      Value configuration = Ask("get_modality_config", {}, options_.reply_s);
      CheckMap("get_modality_config", configuration);
      ReadConfiguration(*configuration.As<Map>());
      return configuration;
    } catch (...) {
      connection_.reset();
      throw;
    }
  }

  bool connected() const override { return connection_.has_value(); }

  void BeginEpisode(const std::string&, int64_t) override {
    if (dialect_ == Dialect::kN15) return;  // has nothing to forget with
    ClosedByFailure([&] { return Ask("reset", Map{{"options", nullptr}}, options_.reply_s); });
  }

  Reply Infer(const Value& observation) override {
    return ClosedByFailure([&] {
      if (!observation.Is<Map>())
        throw InputError("observation: " + Describe(observation) + ", but a map is sent");
      Map entries = *observation.As<Map>();
      for (auto& [key, value] : entries) value = Checked(key, value);
      Value answer;
      try {
        answer = GetAction(entries);
      } catch (const ServerError& error) {
        if (dialect_ != Dialect::kDetect || !AsksForFlat(error, entries)) throw;
        dialect_ = Dialect::kN16Flat;
        answer = GetAction(entries);
      }
      if (dialect_ == Dialect::kDetect) dialect_ = Dialect::kN16;
      answered_ = true;
      return Reply{Actions(std::move(answer)), {}};
    });
  }

  std::string Name() const override {
    switch (dialect_) {
      case Dialect::kN15:
        return "GR00T N1.5";
      case Dialect::kN16:
        return "GR00T N1.6";
      case Dialect::kN16Flat:
        return "GR00T N1.6 (flat)";
      case Dialect::kDetect:
        break;
    }
    return "GR00T";
  }

 private:
  // After a failure that is not the server's own, nobody knows what the next frame would answer.
  template <class Talk>
  auto ClosedByFailure(const Talk& talk) -> decltype(talk()) {
    try {
      return talk();
    } catch (const ServerError& error) {
      if (error.kind() != Kind::kServer) connection_.reset();
      throw;
    }
  }

  Value Ask(const std::string& endpoint, std::optional<Value> data, double limit_s) {
    if (!connection_) throw ServerError(Kind::kUnreachable, options_.url + ": not connected");
    Map request = {{"endpoint", endpoint}};
    if (data) request.emplace_back("data", std::move(*data));
    if (!options_.api_key.empty()) request.emplace_back("api_token", options_.api_key);
    const Bytes reply = connection_->Ask(EncodeGroot(request), limit_s, options_.max_reply_bytes);
    // The oldest servers' only word for every failure.
    constexpr std::string_view kError = "ERROR";
    if (std::equal(reply.begin(), reply.end(), kError.begin(), kError.end())) throw ServerSays("ERROR");
    Value answer = DecodeGroot(reply);
    if (const Value* error = answer.Find("error")) {
      const auto* words = error->As<std::string>();
      throw ServerSays(words ? *words : Describe(*error));
    }
    return answer;
  }

  static void CheckMap(const std::string& endpoint, const Value& answer) {
    if (answer.Is<Map>()) return;
    throw ServerError(Kind::kServer,
                      fmt::format("the server answers {} with {}, no map", endpoint, Describe(answer)));
  }

  // Takes the prefixes away; they tell the dialect.
  void ReadConfiguration(Map& configuration) {
    bool prefixed = false;
    for (auto& [modality, content] : configuration) {
      if (!content.Find("modality_keys") || !content.Find("modality_keys")->Is<List>()) {
        throw ServerError(Kind::kReply,
                          fmt::format("modality configuration: {} is {}, without its modality_keys",
                                      Printable(modality), Describe(content)));
      }
      for (auto& [name, value] : *content.As<Map>()) {
        if (modality == "action" && name == "delta_indices" && value.Is<List>())
          horizon_ = value.As<List>()->size();
        if (name != "modality_keys") continue;
        for (Value& key : *value.As<List>()) {
          std::string* text = key.As<std::string>();
          if (!text || !text->starts_with(modality + '.')) continue;
          text->erase(0, modality.size() + 1);
          prefixed = true;
        }
      }
    }
    if (prefixed && dialect_ == Dialect::kDetect) dialect_ = Dialect::kN15;
  }

  // As kN16 until the server says otherwise.
  Value GetAction(const Map& entries) {
    Map sent;
    if (dialect_ == Dialect::kN15) {
      sent = entries;
      for (auto& [key, value] : sent) {
        if (value.Is<std::string>()) value = List{std::move(value)};
      }
    } else {
      Map video, state, language, flat;
      for (const auto& [key, value] : entries) {
        const Array* array = value.As<Array>();
        flat.emplace_back(key, array ? Value(Batched(*array)) : Value(List{value}));
        if (!array) {
          language.emplace_back(key, List{Value(List{value})});
        } else if (key.starts_with(kVideo)) {
          video.emplace_back(key.substr(kVideo.size()), flat.back().second);
        } else {
          state.emplace_back(key.substr(kState.size()), flat.back().second);
        }
      }
      if (dialect_ != Dialect::kN16Flat) {
        flat = {{"video", std::move(video)}, {"state", std::move(state)}, {"language", std::move(language)}};
      }
      sent = {{"observation", std::move(flat)}, {"options", nullptr}};
    }
    return Ask("get_action", std::move(sent), answered_ ? options_.reply_s : options_.first_reply_s);
  }

  // A server of flat observations names the key that it misses as we name it, with the prefix; the nested
  // ones name it without.
  static bool AsksForFlat(const ServerError& error, const Map& entries) {
    if (error.kind() != Kind::kServer) return false;
    for (const auto& [key, value] : entries) {
      if (value.Is<Array>() && error.details().find(key) != std::string::npos) return true;
    }
    return false;
  }

  Value Actions(Value answer) const {
    if (dialect_ != Dialect::kN15) {
      List* parts = answer.As<List>();  // actions, information
      if (!parts || parts->size() != 2 || !(*parts)[0].Is<Map>()) {
        throw ServerError(Kind::kReply,
                          fmt::format("the server answers an observation with {}, but {} answers with "
                                      "a list of two, of which the first is a map of actions",
                                      Describe(answer), Name()));
      }
      answer = Value((*parts)[0]);
    }
    CheckMap("get_action", answer);
    Map actions;
    for (auto& [key, value] : *answer.As<Map>()) {
      if (const Array* array = value.As<Array>()) {
        actions.emplace_back(key.starts_with(kAction) ? key.substr(kAction.size()) : key,
                             WithoutBatch(key, *array));
      }
    }
    if (actions.empty())
      throw ServerError(Kind::kReply, "the server answers an observation without any action");
    return actions;
  }

  // (1, H, D) or (H, D) -> (H, D); N1.5 leaves out every 1.
  Array WithoutBatch(const std::string& key, Array array) const {
    std::vector<int64_t>& shape = array.shape;
    if (shape.size() == 3 && shape[0] == 1) {
      shape.erase(shape.begin());
    } else if (dialect_ == Dialect::kN15 && shape.size() < 2) {
      shape.resize(1, 1);
      shape.insert(horizon_ == 1u ? shape.begin() : shape.end(), 1);
    }
    if (shape.size() != 2) {
      throw ServerError(Kind::kReply, fmt::format("action {} is {}, not [1, steps, length]", Printable(key),
                                                  Describe(array)));
    }
    return array;
  }

  ClientOptions options_;
  Dialect dialect_;  // kDetect until the server has shown it
  std::optional<size_t> horizon_;
  bool answered_ = false;
  int num_connections_ = 0;
  zmq::context_t context_{1};
  std::optional<Connection> connection_;
};

}  // namespace

std::unique_ptr<PolicyClient> MakeGrootClient(const ClientOptions& options) {
  return std::make_unique<GrootClient>(options);
}

}  // namespace evalbus::policy
