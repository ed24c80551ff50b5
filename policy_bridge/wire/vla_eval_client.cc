// Version 1 of the protocol of vla-eval's model servers (github.com/allenai/vla-evaluation-harness,
// src/vla_eval/protocol, src/vla_eval/model_servers/serve.py). Connect() returns the payload of the server's
// hello: "model_server" and, if present, "action_spec" and "observation_spec". An error message leaves the
// connection open.
#include <fmt/format.h>

#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/websocket_client.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;

constexpr int64_t kProtocolVersion = 1;

struct Envelope {
  std::string type;
  Value payload;
  int64_t seq;
};

double WallTime() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string ErrorText(const Envelope& envelope) {
  const Value* error = envelope.payload.Find("error");
  return error ? TextOrDescription(*error) : Describe(envelope.payload);
}

class VlaEvalClient : public WebsocketClient {
 public:
  explicit VlaEvalClient(const ClientOptions& options) : WebsocketClient(options, ArrayKeys::kTexts) {}

  Value Connect() override {
    seq_ = -1;
    in_episode_ = false;
    const Deadline deadline(options_.connect_s);
    Open(deadline);
    SendMessage("hello", Map{{"harness_version", "evalbus"}, {"protocol_version", kProtocolVersion}},
                deadline);
    Envelope hello = Opened(ReceiveFirst("hello, the first message of a vla-eval server,", deadline));
    if (hello.type == "error") throw Ended(Kind::kServer, ErrorFromServer(ErrorText(hello)).what());
    if (hello.type != "hello")
      throw Ended(Kind::kProtocol, "answers the hello with a message of type " + hello.type);
    const Value* version = hello.payload.Find("protocol_version");
    if (!version || *version != Value(kProtocolVersion)) {
      throw Ended(Kind::kProtocol, fmt::format("uses version {} of vla-eval's protocol, evalbus uses {}",
                                               version ? Describe(*version) : "?", kProtocolVersion));
    }
    return std::move(hello.payload);
  }

  void BeginEpisode(const std::string& instruction, int64_t episode) override {
    const Deadline deadline(options_.reply_s);
    if (in_episode_) SendMessage("episode_end", Map{}, deadline);
    SendMessage(
        "episode_start",
        Map{{"task",
             Map{{"name", instruction}, {"task_description", instruction}, {"episode_idx", episode}}}},
        deadline);
    in_episode_ = true;
  }

  Reply Infer(const Value& observation) override {
    const Deadline deadline = ForReply();
    SendMessage("observation", observation, deadline);
    for (;;) {
      Envelope answer = Opened(Decoded(Receive(deadline)));
      // The error may be the answer to episode_start, which the server answers only if it fails.
      if (answer.type == "error") throw ErrorFrom(ErrorText(answer));
      if (answer.seq < seq_) continue;  // answer to an earlier observation that was abandoned after an error
      if (answer.type != "action" || answer.seq != seq_) {
        throw Ended(Kind::kProtocol,
                    fmt::format("answers observation {} with a message of type {} and number {}", seq_,
                                answer.type, answer.seq));
      }
      Answered();
      return {std::move(answer.payload), {}};
    }
  }

  std::string Name() const override { return "vla-eval websocket"; }

 private:
  Envelope Opened(const Value& message) {
    const Value *type = message.Find("type"), *payload = message.Find("payload"), *seq = message.Find("seq");
    if (!type || !type->Is<std::string>() || !payload || !payload->Is<Map>() || !seq || !seq->Is<int64_t>()) {
      throw Ended(Kind::kProtocol,
                  fmt::format("sends {}; vla-eval's messages have type, payload and seq", Describe(message)));
    }
    return {*type->As<std::string>(), *payload, *seq->As<int64_t>()};
  }

  void SendMessage(const char* type, const Value& payload, const Deadline& deadline) {
    ++seq_;
    Send(Map{{"type", type}, {"payload", payload}, {"seq", seq_}, {"timestamp", WallTime()}}, deadline);
  }

  int64_t seq_ = -1;  // sequence number of the last message sent
  bool in_episode_ = false;
};

}  // namespace

std::unique_ptr<PolicyClient> MakeVlaEvalClient(const ClientOptions& options) {
  return std::make_unique<VlaEvalClient>(options);
}

}  // namespace evalbus::policy
