// Protocol of XPolicyLab's policy server, which RoboDojo and RoboTwin use (github.com/XPolicyLab/XPolicyLab,
// client_server/ws/protocol and client_server/ws/model_server.py at commits 7198143 and 08065c9).
//
// Each message is one map, encoded with MessagePack, whose arrays have msgpack-numpy's form. Requests and
// replies alternate, and a reply repeats the message_id of its request. A server does not answer a request
// that it cannot read. After an error, the connection stays open. The protocol calls an episode a trial, and
// a task text an action case.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <utility>

#include "base/text.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/websocket_client.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;

// Maximum time that a server has to acknowledge the end of the last trial.
constexpr double kFarewellS = 1;

struct RequestType {
  const char *name, *reply;
};
constexpr RequestType kHello{"hello", "hello_ack"}, kPrepareCase{"prepare_case", "prepare_case_ack"},
    kReset{"reset", "reset_result"}, kInfer{"infer", "infer_result"}, kTrialEnd{"trial_end", "trial_end_ack"};

// Meanings of the protocol's error codes. {} stands for the type of the request.
constexpr std::pair<std::string_view, const char*> kErrorCodes[] = {
    {"invalid_frame", "the server cannot read the request {}"},
    {"unknown_message_type", "the server does not support the request {}"},
    {"timeout", "the request {} exceeded the server's own time limit"},
    {"infer_failed", "the model's inference failed"},
    {"reset_failed", "the model's reset failed"},
    {"internal", "the request {} caused an internal error of the server"},
};

[[noreturn]] void FailReply(const std::string& what) { throw ServerError(Kind::kReply, what); }

std::string TextOf(const Value* value) { return value ? TextOrDescription(*value) : ""; }

// Converts a number or a list of numbers in an action to an array with one axis. Returns other values
// unchanged.
Value AsArray(Value value) {
  std::vector<double> numbers;
  const auto add = [&](const Value& number) {
    const std::optional<double> value_of = number.Number();
    if (value_of) numbers.push_back(*value_of);
    return value_of.has_value();
  };
  if (Array* array = value.As<Array>()) {
    if (array->shape.empty()) array->shape = {1};
    return value;
  }
  if (const List* list = value.As<List>()) {
    if (!std::ranges::all_of(*list, add)) return value;
  } else if (!add(value)) {
    return value;
  }
  Array array{"<f8", {static_cast<int64_t>(numbers.size())}, Bytes(8 * numbers.size())};
  if (!numbers.empty()) std::memcpy(array.data.data(), numbers.data(), array.data.size());
  return array;
}

// Joins the H actions of a chunk: a list of {"left_ee_pose": 7 numbers, ...} becomes a map of
// {"left_ee_pose": array (H, 7), ...}. Throws ServerError (kReply) if two actions differ in their keys, or in
// the type or shape of a value.
Map Joined(List actions) {
  Map joined;
  for (size_t step = 0; step < actions.size(); ++step) {
    Map* action = actions[step].As<Map>();
    if (!action)
      FailReply(fmt::format("action {} of the answer is {}, not a map", step, Describe(actions[step])));
    if (step > 0 && action->size() != joined.size()) {
      FailReply(fmt::format("action {} of the answer has {} keys, action 0 has {}", step, action->size(),
                            joined.size()));
    }
    for (auto& [key, value] : *action) {
      Value item = AsArray(std::move(value));
      const Array* array = item.As<Array>();
      const std::string name = fmt::format("'{}' in action {} of the answer", Printable(key), step);
      if (!array) FailReply(fmt::format("{} is {}, expected numbers", name, Describe(item)));
      if (step == 0) {
        std::vector<int64_t> shape = array->shape;
        shape.insert(shape.begin(), 0);
        joined.emplace_back(key, Array{array->dtype, std::move(shape), {}});
      }
      const auto found = std::ranges::find(joined, key, &Map::value_type::first);
      if (found == joined.end()) FailReply(fmt::format("{} is not in action 0", name));
      Array& whole = *found->second.As<Array>();
      if (array->dtype != whole.dtype ||
          !std::equal(array->shape.begin(), array->shape.end(), whole.shape.begin() + 1, whole.shape.end())) {
        FailReply(fmt::format("{} is {}, which differs from action 0", name, Describe(item)));
      }
      ++whole.shape.front();
      whole.data.insert(whole.data.end(), array->data.begin(), array->data.end());
    }
  }
  return joined;
}

class XPolicyLabClient : public WebsocketClient {
 public:
  explicit XPolicyLabClient(const ClientOptions& options)
      : WebsocketClient(options, ArrayKeys::kMsgpackNumpy) {
    std::random_device random;
    evaluation_id_ = fmt::format("evalbus-{:08x}{:08x}", random(), random());
  }

  // Ends the last trial, because a server may then write its results. After "close", the server ends the
  // connection.
  ~XPolicyLabClient() override {
    if (!connected()) return;
    const Deadline deadline(kFarewellS);
    try {
      EndTrial(deadline);
      SendRequest("close", Map{{"reason", "the evaluation has ended"}}, deadline);
    } catch (const std::exception&) {
      // An error is ignored, because no result depends on these messages and the client is no longer in use.
    }
  }

  // If a lost connection interrupted a trial, the next BeginEpisode() ends it.
  Value Connect() override {
    prepared_.reset();
    const Deadline deadline(options_.connect_s);
    Open(deadline);
    const std::string id = SendRequest(kHello.name, Map{}, deadline);
    return Payload(kHello, id, ReceiveFirst("hello_ack, the answer of an XPolicyLab server,", deadline));
  }

  void BeginEpisode(const std::string& instruction, int64_t episode) override {
    EndTrial(ForReply());
    case_id_ = instruction;
    if (prepared_ != instruction) {
      Call(kPrepareCase, Map{{"action_case_id", instruction}, {"instruction", instruction}}, ForReply());
      prepared_ = instruction;
    }
    trial_id_ = fmt::format("{}-{}-episode{}", evaluation_id_, ++num_trials_, episode);
    step_ = 0;
    Call(kReset, Map{{"trial_id", trial_id_}}, ForReply(), episode);
  }

  Reply Infer(const Value& observation) override {
    Value payload = Call(kInfer, Map{{"observation", observation}}, ForReply());
    Value* actions = nullptr;
    for (auto& [key, value] : *payload.As<Map>()) {
      if (key == "actions") actions = &value;
    }
    if (!actions) {
      throw Ended(Kind::kReply, fmt::format("answers with {}, which has no \"actions\"", Describe(payload)));
    }
    Answered();
    ++step_;
    Reply reply;
    if (const Value* latency = payload.Find("latency_ms")) {
      if (const std::optional<double> ms = latency->Number()) reply.SetServerTime(*ms);
    }
    if (List* list = actions->As<List>(); list && !list->empty() && list->front().Is<Map>()) {
      try {
        reply.value = Joined(std::move(*list));
      } catch (const ServerError& error) {
        throw Ended(error.kind(), error.what());
      }
    } else {
      reply.value = std::move(payload);
    }
    return reply;
  }

  std::string Name() const override { return "XPolicyLab websocket"; }

 private:
  // Sends a request, and returns its message_id.
  std::string SendRequest(const char* type, Map payload, const Deadline& deadline,
                          std::optional<int64_t> repeat_index = {}) {
    std::string id = fmt::format("{}-{}", evaluation_id_, ++num_requests_);
    const auto text = [](const std::string& word) { return word.empty() ? Value() : Value(word); };
    Send(Map{{"message_type", type},
             {"evaluation_id", evaluation_id_},
             {"action_case_id", text(case_id_)},
             {"trial_id", text(trial_id_)},
             {"repeat_index", repeat_index ? Value(*repeat_index) : Value()},
             {"step", step_},
             {"message_id", id},
             {"payload", std::move(payload)}},
         deadline);
    return id;
  }

  // Sends a request, and returns the payload (a map) of the reply.
  Value Call(const RequestType& type, Map payload, const Deadline& deadline,
             std::optional<int64_t> repeat_index = {}) {
    if (const auto unasked = ReceiveNow()) {
      throw Ended(Kind::kProtocol, "sent an unexpected message: " + Describe(Decoded(*unasked)));
    }
    const std::string id = SendRequest(type.name, std::move(payload), deadline, repeat_index);
    return Payload(type, id, Decoded(Receive(deadline)));
  }

  Value Payload(const RequestType& type, const std::string& id, Value reply) {
    const Value *reply_type = reply.Find("message_type"), *reply_id = reply.Find("message_id");
    const Value* payload = reply.Find("payload");
    if (!reply_type || !reply_type->Is<std::string>() || !reply_id || !payload || !payload->Is<Map>()) {
      throw Ended(Kind::kProtocol, fmt::format("answers {} with {}; XPolicyLab's messages have message_type, "
                                               "message_id and payload",
                                               type.name, Describe(reply)));
    }
    if (*reply_id != Value(id)) {
      throw Ended(Kind::kProtocol, fmt::format("answers {} with a message for another request, {}", type.name,
                                               Describe(*reply_id)));
    }
    if (*reply_type == Value("error")) throw ErrorOf(type, *payload);
    if (*reply_type != Value(type.reply)) {
      throw Ended(Kind::kProtocol, fmt::format("answers {} with {}, expected {}", type.name,
                                               Describe(*reply_type), type.reply));
    }
    return *payload;
  }

  // Returns the error for an error message from the server. The connection stays open.
  ServerError ErrorOf(const RequestType& type, const Value& payload) const {
    const std::string code = TextOf(payload.Find("code"));
    const ServerError reported = ErrorFromServer(TextOf(payload.Find("message")));
    const auto* known = std::ranges::find(kErrorCodes, code, [](const auto& entry) { return entry.first; });
    const char* meaning = known == std::end(kErrorCodes) ? "the request {} failed" : known->second;
    return {reported.kind(),
            fmt::format("{}: {} ({}); {}", options_.url, fmt::format(fmt::runtime(meaning), type.name),
                        code.empty() ? "no error code" : Printable(Cut(code, 40)), reported.what()),
            reported.details()};
  }

  // Ends the current trial, if any. If the connection is lost meanwhile, the trial is ended later.
  void EndTrial(const Deadline& deadline) {
    if (trial_id_.empty()) return;
    try {
      Call(kTrialEnd, Map{{"trial_id", trial_id_}}, deadline);
    } catch (const ServerError& error) {
      if (error.kind() == Kind::kServer) trial_id_.clear();
      throw;
    }
    trial_id_.clear();
  }

  std::string evaluation_id_;
  std::string trial_id_, case_id_;       // empty: none
  std::optional<std::string> prepared_;  // task text that was prepared on this connection
  int64_t num_requests_ = 0, num_trials_ = 0;
  int64_t step_ = 0;  // number of inferences in the current trial so far
};

}  // namespace

std::unique_ptr<PolicyClient> MakeXPolicyLabClient(const ClientOptions& options) {
  return std::make_unique<XPolicyLabClient>(options);
}

}  // namespace evalbus::policy
