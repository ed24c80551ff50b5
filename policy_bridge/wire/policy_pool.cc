#include "policy_bridge/wire/policy_pool.h"

#include <stdlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "base/errors.h"
#include "base/scratch.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/zeromq.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;
using Clock = std::chrono::steady_clock;

// Keys of the messages between the processes of a run. A request is {"observation": ...}, or an empty map to
// connect to the server. An answer is {"value", "server_s"} or {"error", "kind", "details"}.
constexpr const char *kObservation = "observation", *kValue = "value", *kServerS = "server_s",
                     *kError = "error", *kKind = "kind", *kDetails = "details";
// "kind" of an error that is caused by the observation, not by the server.
constexpr int64_t kWrongInput = -1;

// The pool waits for other clients as long as the last request took, but at most this long (or `gather`, if
// that is longer). Without this bound, it might wait for minutes.
constexpr auto kLongestWait = std::chrono::seconds(1);

// Practically no deadline, because the pool itself applies the server's deadlines, and answers earlier
// requests first.
constexpr double kAnswerTimeout = 1e6;  // s

Value Answer(const Reply& reply) {
  Map answer = {{kValue, reply.value}};
  if (reply.server_s) answer.emplace_back(kServerS, *reply.server_s);
  return answer;
}

// Returns the answer that reports the exception being handled.
Value Failure() {
  try {
    throw;
  } catch (const ServerError& error) {
    return Map{
        {kError, error.what()}, {kKind, static_cast<int64_t>(error.kind())}, {kDetails, error.details()}};
  } catch (const InputError& error) {
    return Map{{kError, error.what()}, {kKind, kWrongInput}, {kDetails, ""}};
  } catch (const std::exception& error) {
    return Map{{kError, error.what()}, {kKind, static_cast<int64_t>(Kind::kProtocol)}, {kDetails, ""}};
  }
}

std::string TextOf(const Value& answer, const char* key) {
  const Value* found = answer.Find(key);
  const auto* text = found ? found->As<std::string>() : nullptr;
  return text ? *text : "";
}

Reply ReadAnswer(Value answer) {
  if (answer.Find(kError)) {
    const Value* kind = answer.Find(kKind);
    const auto* number = kind ? kind->As<int64_t>() : nullptr;
    if (number && *number == kWrongInput) throw InputError(TextOf(answer, kError));
    throw ServerError(number ? static_cast<Kind>(*number) : Kind::kProtocol, TextOf(answer, kError),
                      TextOf(answer, kDetails));
  }
  Reply reply;
  const Value* seconds = answer.Find(kServerS);
  if (seconds && seconds->Is<double>()) reply.server_s = *seconds->As<double>();
  if (const Value* value = answer.Find(kValue)) reply.value = *value;
  return reply;
}

class PoolClient : public PolicyClient {
 public:
  explicit PoolClient(const ClientOptions& options) : options_(options) {}

  Value Connect() override {
    is_connected_ = false;
    socket_.reset();
    socket_.emplace(options_.pool_url, options_.connect_s, options_.max_reply_bytes);
    Value metadata = Call(Map{}).value;
    is_connected_ = true;
    return metadata;
  }
  bool connected() const override { return is_connected_; }
  void BeginEpisode(const std::string&, int64_t) override {}
  Reply Infer(const Value& observation) override {
    try {
      return Call(Map{{kObservation, observation}});
    } catch (const ServerError& error) {
      is_connected_ = error.kind() == Kind::kServer;
      throw;
    }
  }
  std::string Name() const override { return "pool of " + options_.url; }

 private:
  Reply Call(const Value& request) {
    if (!socket_) throw ServerError(Kind::kUnreachable, options_.url + ": not connected");
    return ReadAnswer(
        DecodeMsgpack(socket_->Call(EncodeMsgpack(request, ArrayKeys::kTexts), kAnswerTimeout)));
  }

  const ClientOptions options_;
  std::optional<RequestSocket> socket_;
  bool is_connected_ = false;
};

}  // namespace

struct PolicyPool::State {
  // A pending request and the client that sent it.
  struct Question {
    std::string from;
    Value observation;
    Clock::time_point since;
  };

  // Runs on the pool's thread until the context is shut down.
  void Serve() {
    try {
      while (true) {
        Listen();
        if (IsTime()) CallServer();
      }
    } catch (const zmq::error_t&) {
    }
    socket.close();
  }

  void Listen() {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(WaitsUntil() - Clock::now());
    zmq::pollitem_t item = {socket.handle(), 0, ZMQ_POLLIN, 0};
    try {
      zmq::poll(
          &item, 1,
          waiting.empty() ? std::chrono::milliseconds(-1) : std::max(left, std::chrono::milliseconds(0)));
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
    zmq::message_t from, between, body;
    while (socket.recv(from, zmq::recv_flags::dontwait)) {
      if (!from.more() || !socket.recv(between) || !between.more() || !socket.recv(body)) continue;
      Take(from.to_string(), body);
    }
  }

  void Take(const std::string& from, const zmq::message_t& body) {
    try {
      const Value request = DecodeMsgpack({body.data<uint8_t>(), body.size()});
      if (const Value* observation = request.Find(kObservation)) {
        waiting.push_back({from, *observation, Clock::now()});
        return;
      }
      Connect();
      last_request[from] = num_requests;
      Send(from, Map{{kValue, metadata}});
    } catch (const zmq::error_t&) {
      throw;
    } catch (...) {
      Send(from, Failure());
    }
  }

  void Connect() {
    if (!client->connected()) metadata = client->Connect();
  }

  Clock::time_point WaitsUntil() const {
    return waiting.empty()
               ? Clock::time_point::max()
               : std::max(waiting.front().since, idle_since) + std::max<Clock::duration>(gather, took);
  }

  bool IsTime() const {
    if (waiting.empty()) return false;
    const auto waits = [this](const auto& known) {
      return std::ranges::find(waiting, known.first, &Question::from) != waiting.end();
    };
    return waiting.size() >= batch_size || std::ranges::all_of(last_request, waits) ||
           Clock::now() >= WaitsUntil();
  }

  void CallServer() {
    std::vector<Question> batch;
    std::vector<Value> observations;
    for (; !waiting.empty() && batch.size() < batch_size; waiting.pop_front()) {
      batch.push_back(std::move(waiting.front()));
      observations.push_back(std::move(batch.back().observation));
    }
    const auto begin = Clock::now();
    std::vector<Value> answers;
    try {
      Connect();
      for (const Reply& reply : client->InferBatch(observations)) answers.push_back(Answer(reply));
    } catch (const ServerError& error) {
      answers.clear();
      for (const Value& observation : observations) {
        const bool again = error.kind() == Kind::kServer && batch.size() > 1;
        answers.push_back(again ? CallAlone(observation) : Failure());
      }
    } catch (...) {
      answers.assign(batch.size(), Failure());
    }
    idle_since = Clock::now();
    took = std::min<Clock::duration>(idle_since - begin, kLongestWait);
    ++num_requests;
    for (size_t i = 0; i < batch.size(); ++i) {
      last_request[batch[i].from] = num_requests;
      Send(batch[i].from, answers[i]);
    }
    std::erase_if(last_request, [this](const auto& known) { return known.second < num_requests - 1; });
  }

  Value CallAlone(const Value& observation) {
    try {
      return Answer(client->Infer(observation));
    } catch (...) {
      return Failure();
    }
  }

  void Send(const std::string& to, const Value& answer) {
    socket.send(zmq::buffer(to), zmq::send_flags::sndmore);
    socket.send(zmq::message_t(), zmq::send_flags::sndmore);
    socket.send(zmq::buffer(EncodeMsgpack(answer, ArrayKeys::kTexts)), zmq::send_flags::none);
  }

  size_t batch_size = 1;
  std::chrono::milliseconds gather{};
  std::unique_ptr<PolicyClient> client;
  // The server's description of itself, as returned by Connect().
  Value metadata;
  std::deque<Question> waiting;
  // Clients that are expected to send a request soon. For each client: value of num_requests when the client
  // last received an answer, or when it connected.
  std::map<std::string, int64_t> last_request;
  int64_t num_requests = 0;
  Clock::time_point idle_since{};
  Clock::duration took{};
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::router};
};

PolicyPool::PolicyPool(ClientOptions server, int batch_size, std::chrono::milliseconds gather)
    : state_(std::make_shared<State>()) {
  server.pool_url.clear();
  state_->client = MakePolicyClient(server);
  state_->batch_size = static_cast<size_t>(batch_size);
  state_->gather = gather;
  // The socket is a Unix socket, because workers may run in separate network namespaces.
  folder_ = (FolderOfTemporaryFiles() / "evalbus-pool-XXXXXX").string();
  if (!mkdtemp(folder_.data())) {
    throw EnvironmentError("cannot make " + folder_ + ": " + std::strerror(errno));
  }
  url_ = "ipc://" + folder_ + "/socket";
  try {
    state_->socket.set(zmq::sockopt::linger, 0);
    state_->socket.bind(url_);
  } catch (const zmq::error_t& error) {
    throw EnvironmentError("cannot listen at " + url_ + ": " + error.what());
  }
  // The thread is detached, because it may be waiting for the server.
  std::thread([state = state_] { state->Serve(); }).detach();
}

PolicyPool::~PolicyPool() {
  state_->context.shutdown();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::unique_ptr<PolicyClient> MakePoolClient(const ClientOptions& options) {
  return std::make_unique<PoolClient>(options);
}

}  // namespace evalbus::policy
