// The server's side of a WebSocket connection: it performs the handshake, receives the client's messages, and
// sends frames one at a time. Everything runs on the thread of the server's Listener.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace evalbus::viz {

// A session exists until its connection is closed. Must be owned by a shared_ptr.
class WebSocketSession : public std::enable_shared_from_this<WebSocketSession> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  struct Limits {
    // handshake: timeout for the handshake. idle: timeout for a client that sends nothing and reads nothing,
    // not even the server's pings.
    std::chrono::seconds handshake, idle;
    // Maximum size of a client's message in bytes. A larger message closes the connection.
    size_t message;
  };

  virtual ~WebSocketSession() = default;
  WebSocketSession(const WebSocketSession&) = delete;
  WebSocketSession& operator=(const WebSocketSession&) = delete;

  // Sends frames until NextFrame() returns no frame. Does nothing before the session is open, or while a
  // frame is being sent, because the next frame follows automatically.
  void Write();

 protected:
  struct Frame {
    bool is_binary = true;
    std::shared_ptr<const std::string> bytes;
  };

  WebSocketSession(boost::beast::tcp_stream stream, const Limits& limits);

  // Answers the client's request to upgrade. subprotocol: the selected subprotocol, or empty.
  void Accept(const Request& request, const std::string& subprotocol = "");

  // Called after the handshake.
  virtual void OnOpen() = 0;
  // Returns false if the connection must be closed, with the code "policy violation".
  virtual bool OnMessage(std::string_view bytes, bool is_text) = 0;
  // Returns the next frame to send, if there is one.
  virtual std::optional<Frame> NextFrame() = 0;

 private:
  void Read();
  void Close();
  // Closes the connection, and aborts a pending write.
  void Drop();

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  const Limits limits_;
  boost::beast::flat_buffer buffer_;
  bool is_open_ = false, is_writing_ = false, is_closing_ = false;
};

}  // namespace evalbus::viz
