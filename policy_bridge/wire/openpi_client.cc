// Protocol of openpi's websocket policy server and compatible servers
// (github.com/Physical-Intelligence/openpi, src/openpi/serving/websocket_policy_server.py), and RoboArena's
// dialect of it (github.com/robo-arena/roboarena, roboarena/policy_server.py), which vLLM-Omni also serves
// (github.com/vllm-project/vllm-omni, vllm_omni/entrypoints/openpi/connection.py).
//
// The server first sends its metadata; then requests and replies alternate. An error is sent as a text
// message and ends the connection. RoboArena's dialect is used if the server's metadata contain
// "action_space", or if the wire is Wire::kRoboArena. In this dialect, every request contains "endpoint" (and
// "session_id" if the metadata set "needs_session_id"), and a reset is sent at the beginning of an episode.
// vLLM-Omni answers a reset with a map. It also reports an error as a map, and then keeps the connection
// open.
#include <fmt/format.h>

#include <random>

#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/websocket_client.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;
constexpr const char* kResetAnswer = "reset successful";

// Returns a session id that no other client of this server uses.
std::string NewSessionId(int64_t episode) {
  std::random_device random;
  return fmt::format("evalbus-episode{}-{:08x}{:08x}", episode, random(), random());
}

class OpenpiClient : public WebsocketClient {
 public:
  explicit OpenpiClient(const ClientOptions& options)
      : WebsocketClient(options, ArrayKeys::kBytes), is_robo_arena_(options.wire == Wire::kRoboArena) {}

  Value Connect() override {
    is_used_ = false;
    const Deadline deadline(options_.connect_s);
    Open(deadline);
    Value metadata = ReceiveFirst("metadata, which an openpi server sends first,", deadline);
    if (!metadata.Is<Map>()) {
      throw Ended(Kind::kProtocol,
                  fmt::format("sends {} first; an openpi server sends a map of its metadata first",
                              Describe(metadata)));
    }
    is_robo_arena_ = options_.wire == Wire::kRoboArena || metadata.Find("action_space");
    const Value* needs_session_id = metadata.Find("needs_session_id");
    session_id_ = needs_session_id && *needs_session_id == Value(true) ? NewSessionId(0) : "";
    return metadata;
  }

  void BeginEpisode(const std::string&, int64_t episode) override {
    if (!is_robo_arena_) {
      if (is_used_) Reconnect();
      return;
    }
    if (!session_id_.empty()) session_id_ = NewSessionId(episode);
    const Websocket::Message reply = Call(Map{}, "reset");
    if (reply.is_text && reply.Text() == kResetAnswer) return;
    const Value value = Answer(reply);
    const Value* status = value.Find("status");  // used by vLLM-Omni
    if (status && *status == Value(kResetAnswer)) return;
    throw Ended(Kind::kProtocol,
                "answers a reset with " + Describe(value) + ", expected \"" + kResetAnswer + "\"");
  }

  Reply Infer(const Value& observation) override {
    Reply reply{Answer(Call(*observation.As<Map>(), "infer")), {}};
    // The first versions of RoboArena's server answered with a bare array.
    if (is_robo_arena_ && reply.value.Is<Array>()) reply.value = Map{{"actions", std::move(reply.value)}};
    if (!reply.value.Is<Map>()) {
      throw Ended(Kind::kReply, fmt::format("answers with {}, not with a map", Describe(reply.value)));
    }
    Answered();
    is_used_ = true;
    if (const Value* timing = reply.value.Find("server_timing")) {
      const Value* infer_ms = timing->Find("infer_ms");
      if (const auto ms = infer_ms ? infer_ms->Number() : std::nullopt) reply.SetServerTime(*ms);
    }
    return reply;
  }

  std::string Name() const override { return is_robo_arena_ ? "RoboArena websocket" : "openpi websocket"; }

 private:
  // Reconnects to the same server. Its model is compiled already, so the shorter deadline applies to all
  // answers.
  void Reconnect() {
    Connect();
    Answered();
  }

  // Returns the content of a reply. If it is an error (a text or, with vLLM-Omni, a map), throws it.
  Value Answer(const Websocket::Message& reply) {
    Value value = Decoded(reply);
    const Value* type = is_robo_arena_ ? value.Find("type") : nullptr;
    if (type && *type == Value("error")) {
      const Value* message = value.Find("message");
      const auto* words = message ? message->As<std::string>() : nullptr;
      throw ErrorFrom(words ? *words : Describe(value));
    }
    return value;
  }

  Websocket::Message Call(Map request, const char* endpoint) {
    if (is_robo_arena_) {
      if (!session_id_.empty()) request.emplace_back("session_id", session_id_);
      request.emplace_back("endpoint", endpoint);
    }
    if (const auto unasked = ReceiveNow()) {
      const Value value = Decoded(*unasked);
      throw Ended(Kind::kProtocol, "sent an unexpected message: " + Describe(value));
    }
    const Deadline deadline = ForReply();
    Send(request, deadline);
    return Receive(deadline);
  }

  bool is_robo_arena_;
  bool is_used_ = false;    // whether an observation has been answered on this connection
  std::string session_id_;  // empty if the server needs none
};

}  // namespace

std::unique_ptr<PolicyClient> MakeOpenpiClient(const ClientOptions& options) {
  return std::make_unique<OpenpiClient>(options);
}

}  // namespace evalbus::policy
