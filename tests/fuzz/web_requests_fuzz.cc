// Sends any bytes as requests to a web server. Parts of the input serve as targets, headers and messages. The
// whole input is sent over loopback to a server, as a request and as the data after a WebSocket handshake.
// The server must answer or close the connection, and must accept the next one.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "tests/fuzz/fuzz_target.h"
#include "viz/web/page.h"
#include "viz/web/server.h"

namespace {

using namespace evalbus::viz;

constexpr char kToken[] = "0123456789abcdef0123456789abcdef";
constexpr char kHandshake[] =
    "GET /live HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

[[noreturn]] void Fail(const char* what) {
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

void CheckParts(std::string_view bytes) {
  for (const char* token : {"", kToken}) {
    const WebTarget target = ParseTarget(bytes, token);
    if (target.kind == WebTarget::Kind::kNone) continue;
    if (*token && bytes.find(kToken) != 1) Fail("a target without the token is answered");
    if (target.name.find('/') != std::string::npos || target.name.starts_with("."))
      Fail("a name with folders");
    if (target.kind == WebTarget::Kind::kEpisode && (target.run < 0 || target.episode < 0))
      Fail("a negative number");
  }
  if (IsLoopbackHost(bytes) && bytes.find("localhost") == bytes.npos &&
      bytes.find("127.0.0.1") == bytes.npos && bytes.find("[::1]") == bytes.npos) {
    Fail("the Host of another machine counts as this machine");
  }
  if (!bytes.empty() && IsOwnOrigin(bytes, "localhost:8080") && bytes != "http://localhost:8080") {
    Fail("a foreign Origin counts as our own");
  }
  if (const auto run = ParseWatch(bytes); run && *run < 0) Fail("a negative run is watched");
}

WebServer& Server() {
  static const auto broadcaster = std::make_shared<UpdateBroadcaster>();
  static const auto server = [] {
    std::signal(SIGPIPE, SIG_IGN);
    broadcaster->SetRun(0, "run");
    auto made = std::make_unique<WebServer>(WebServer::Address(), broadcaster);
    made->Start([](const WebTarget& target, WebServer::Reply reply) {
      reply(AnswerFile(target.kind == WebTarget::Kind::kPage ? "index.html" : target.name));
    });
    return made;
  }();
  return *server;
}

// Returns the server's answer until it closes the connection. It must close it, because our side is closed.
std::string Answer(const std::string& bytes) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(Server().port());
  const timeval timeout{.tv_sec = 20, .tv_usec = 0};
  // Resets the connection on close. Otherwise thousands of connections in TIME_WAIT would use up all ports.
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    Fail("the server no longer runs");
  // The server may close the connection before everything is sent.
  for (size_t sent = 0; sent < bytes.size();) {
    const ssize_t n = send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) break;
    sent += static_cast<size_t>(n);
  }
  shutdown(fd, SHUT_WR);
  std::string answer;
  char part[4096];
  ssize_t n = 0;
  while ((n = recv(fd, part, sizeof part, 0)) > 0) answer.append(part, static_cast<size_t>(n));
  if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) Fail("the connection stays open");
  close(fd);
  return answer;
}

}  // namespace

FUZZ_TARGET(web_requests) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  CheckParts(bytes);
  const std::string answer = Answer(bytes);
  if (!answer.empty() && !answer.starts_with("HTTP/1.1 ")) Fail("the answer is not HTTP");
  if (!Answer(kHandshake + bytes).starts_with("HTTP/1.1 101")) Fail("a viewer was refused");
  return 0;
}
