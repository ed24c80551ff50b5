// Client of policy servers that answer POST /act with json-numpy, such as OpenVLA and OpenVLA-OFT.
//
// An observation is sent as one JSON object with its keys in the map's order, because the model's inputs have
// this order. An answer is one array (D,) or (H, D), or a list of H arrays (D,); Infer() returns it as
// "actions" (H, D). These servers have no session and do not describe themselves. Each request uses a new
// connection, because the servers close connections that are idle while the simulation runs; Connect() only
// checks that there is a server.
#include <fmt/format.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <optional>

#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/url.h"

namespace evalbus::policy {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;
using Kind = ServerError::Kind;

// Maximum number of interim HTTP responses before the final one.
constexpr int kMaxInterim = 16;

std::chrono::nanoseconds Duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

// Starts an asynchronous operation with `start`, and runs it until its handler has been called.
template <class Start>
error_code Finish(asio::io_context& io, const Start& start) {
  error_code result;
  start([&](error_code error, auto&&...) { result = error; });
  io.restart();
  io.run();
  return result;
}

class RestClient : public PolicyClient {
 public:
  explicit RestClient(const ClientOptions& options) : options_(options), url_(ParseUrl(options.url, "http")) {
    if (url_.target.empty() || url_.target == "/") url_.target = "/act";
  }

  Value Connect() override {
    connected_ = false;
    asio::io_context io;
    Open(io);
    connected_ = true;
    return Map{};
  }

  bool connected() const override { return connected_; }

  void BeginEpisode(const std::string&, int64_t) override {}

  Reply Infer(const Value& observation) override {
    if (!connected_) Fail(Kind::kUnreachable, "not connected");
    const std::string request = EncodeJsonNumpy(observation);
    try {
      Value answer = Parse(Post(request, answered_ ? options_.reply_s : options_.first_reply_s));
      answered_ = true;
      return {Map{{"actions", Actions(answer)}}, {}};
    } catch (const ServerError& error) {
      if (error.kind() != Kind::kServer) connected_ = answered_ = false;
      throw;
    }
  }

  std::string Name() const override { return "REST " + url_.target; }

 private:
  [[noreturn]] void Fail(Kind kind, const std::string& why) const {
    throw ServerError(kind, fmt::format("{}: {}", options_.url, why));
  }

  beast::tcp_stream Open(asio::io_context& io) const {
    std::vector<tcp::endpoint> endpoints;
    for (const std::string& address : Resolve(url_, options_.connect_s)) {
      endpoints.emplace_back(asio::ip::make_address(address), static_cast<uint16_t>(std::stoi(url_.port)));
    }
    beast::tcp_stream stream(io);
    stream.expires_after(Duration(options_.connect_s));
    const error_code error = Finish(io, [&](auto done) { stream.async_connect(endpoints, done); });
    if (error == beast::error::timeout) {
      Fail(Kind::kTimeout, fmt::format("no connection in {} s", options_.connect_s));
    }
    if (error) Fail(Kind::kUnreachable, error.message());
    return stream;
  }

  // Sends a request, and returns the body of the response.
  std::string Post(const std::string& body, double limit_s) const {
    asio::io_context io;
    beast::tcp_stream stream = Open(io);
    stream.expires_after(Duration(limit_s));

    http::request<http::string_body> request{http::verb::post, url_.target, 11, body};
    request.set(http::field::host, HostAndPort(url_.host, url_.port));
    request.set(http::field::user_agent, "evalbus");
    request.set(http::field::content_type, "application/json");
    if (!options_.api_key.empty()) request.set(http::field::authorization, "Api-Key " + options_.api_key);
    request.keep_alive(false);
    request.prepare_payload();
    const error_code unsent = Finish(io, [&](auto done) { http::async_write(stream, request, done); });

    // A dynamic body grows with the received data, not with the announced length. A server that rejects a
    // request responds before it has read all of it. Therefore the response is read even if the request was
    // not sent completely.
    std::optional<http::response_parser<http::dynamic_body>> response;
    beast::flat_buffer buffer;
    error_code error = unsent;
    for (int interim = 0; error != beast::error::timeout; ++interim) {
      if (interim > kMaxInterim) Fail(Kind::kProtocol, "only interim HTTP answers (status 1xx)");
      response.emplace();
      response->body_limit(options_.max_reply_bytes);
      // The header is read separately. Otherwise, if part of the body arrives with the header, Beast 1.74
      // loses the error that the announced length is too large.
      error = Finish(io, [&](auto done) { http::async_read_header(stream, buffer, *response, done); });
      if (error) break;
      // Interim responses such as "100 Continue" precede the final one.
      if (response->get().result_int() / 100 == 1) continue;
      error = Finish(io, [&](auto done) { http::async_read(stream, buffer, *response, done); });
      break;
    }
    if (error == beast::error::timeout) Fail(Kind::kTimeout, fmt::format("no answer in {} s", limit_s));
    if (error == http::error::body_limit) {
      Fail(Kind::kProtocol, fmt::format("an answer of more than {} bytes", options_.max_reply_bytes));
    }
    if (error == http::error::end_of_stream || error == asio::error::connection_reset) {
      Fail(Kind::kUnreachable, "the connection ended without a complete answer");
    }
    if (error) Fail(Kind::kProtocol, fmt::format("incomplete or malformed HTTP answer: {}", error.message()));

    std::string answer = beast::buffers_to_string(response->get().body().data());
    if (response->get().result() != http::status::ok) {
      throw ServerError(Kind::kServer,
                        fmt::format("{}: HTTP status {}: {}", options_.url, response->get().result_int(),
                                    ErrorFromServer(answer).what()),
                        answer);
    }
    return answer;
  }

  // These servers report failures as text with status OK. If the request was JSON text within a JSON string,
  // the answer is also such a string.
  static Value Parse(const std::string& body) {
    Value answer = DecodeJsonNumpy(body);
    if (const auto* text = answer.As<std::string>()) {
      const std::string words = *text;
      try {
        answer = DecodeJsonNumpy(words);
      } catch (const ServerError&) {
        throw ErrorFromServer(words);
      }
      if (answer.Is<std::string>()) throw ErrorFromServer(*answer.As<std::string>());
    }
    if (const Value* error = answer.Find("error")) throw ErrorFromServer(TextOrDescription(*error));
    return answer;
  }

  static Array Actions(const Value& answer) {
    const auto refuse = [](const Value& value, const char* where) {
      throw ServerError(Kind::kReply,
                        fmt::format("the server answers with {}{}, not with one array of actions or a "
                                    "list of arrays of equal type and length",
                                    Describe(value), where));
    };
    if (const Array* array = answer.As<Array>()) {
      Array actions = *array;
      if (actions.shape.size() == 1) actions.shape.insert(actions.shape.begin(), 1);
      if (actions.shape.size() != 2) refuse(answer, "");
      return actions;
    }
    const List* rows = answer.As<List>();
    if (!rows || rows->empty()) refuse(answer, "");
    Array actions;
    for (const Value& row : *rows) {
      const Array* array = row.As<Array>();
      if (!array || array->shape.size() != 1) refuse(row, " in a list");
      if (&row == &rows->front()) {
        actions = {array->dtype, {static_cast<int64_t>(rows->size()), array->shape[0]}, {}};
      } else if (array->dtype != actions.dtype || array->shape[0] != actions.shape[1]) {
        refuse(row, " in a list that begins with another type or length");
      }
      actions.data.insert(actions.data.end(), array->data.begin(), array->data.end());
    }
    return actions;
  }

  ClientOptions options_;
  Url url_;
  bool connected_ = false, answered_ = false;
};

}  // namespace

std::unique_ptr<PolicyClient> MakeRestClient(const ClientOptions& options) {
  return std::make_unique<RestClient>(options);
}

}  // namespace evalbus::policy
