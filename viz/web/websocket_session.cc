#include "viz/web/websocket_session.h"

#include <utility>

namespace evalbus::viz {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

WebSocketSession::WebSocketSession(beast::tcp_stream stream, const Limits& limits)
    : stream_(std::move(stream)), limits_(limits), buffer_(limits.message) {}

void WebSocketSession::Accept(const Request& request, const std::string& subprotocol) {
  beast::get_lowest_layer(stream_).expires_never();
  stream_.set_option(
      websocket::stream_base::timeout{limits_.handshake, limits_.idle, /*keep_alive_pings=*/true});
  if (!subprotocol.empty()) {
    stream_.set_option(websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
      response.set(beast::http::field::sec_websocket_protocol, subprotocol);
    }));
  }
  stream_.read_message_max(limits_.message);
  stream_.auto_fragment(false);
  stream_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (error) return;
    self->is_open_ = true;
    self->OnOpen();
    self->Read();
    self->Write();
  });
}

void WebSocketSession::Write() {
  if (!is_open_ || is_writing_ || is_closing_) return;
  const std::optional<Frame> frame = NextFrame();
  if (!frame) return;
  is_writing_ = true;
  stream_.binary(frame->is_binary);
  const boost::asio::const_buffer buffer = boost::asio::buffer(*frame->bytes);
  stream_.async_write(buffer, [self = shared_from_this(), bytes = frame->bytes](error_code error, size_t) {
    self->is_writing_ = false;
    if (!error) self->Write();
  });
}

void WebSocketSession::Read() {
  stream_.async_read(buffer_, [self = shared_from_this()](error_code error, size_t) {
    if (error) return self->Drop();
    const auto data = self->buffer_.data();
    const bool is_good =
        self->OnMessage({static_cast<const char*>(data.data()), data.size()}, self->stream_.got_text());
    self->buffer_.consume(self->buffer_.size());
    if (!is_good) return self->Close();
    self->Write();
    self->Read();
  });
}

void WebSocketSession::Close() {
  is_closing_ = true;
  stream_.async_close(websocket::close_code::policy_error,
                      [self = shared_from_this()](error_code) { self->Drop(); });
}

void WebSocketSession::Drop() {
  is_closing_ = true;
  beast::get_lowest_layer(stream_).close();
}

}  // namespace evalbus::viz
