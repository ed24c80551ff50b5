#include "tests/doubles/groot_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <zmq.hpp>

#include "policy_bridge/wire/codecs.h"

namespace evalbus::doubles {

using policy::Array;
using policy::Bytes;
using policy::List;
using policy::Map;
using policy::Value;
using Dialect = policy::ClientOptions::GrootDialect;

struct GrootServer::Sockets {
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::rep};
};

namespace {

constexpr const char* kLanguage = "annotation.human.task_description";

// Throws the error that Python would raise and the server would send.
void Demand(bool holds, const std::string& otherwise) {
  if (!holds) throw std::runtime_error(otherwise);
}

const Array& ArrayOf(const Value& observation, const std::string& key, const char* dtype, size_t rank) {
  const Value* value = observation.Find(key);
  Demand(value, fmt::format("Key '{}' must be in observation", key));
  const Array* array = value->As<Array>();
  Demand(array, fmt::format("Key '{}' must be an array", key));
  Demand(array->dtype == dtype, fmt::format("Key '{}' has type {}", key, array->dtype));
  Demand(array->shape.size() == rank, fmt::format("Key '{}' has {} dimensions", key, array->shape.size()));
  return *array;
}

Array Squeezed(Array array) {
  std::erase(array.shape, 1);
  return array;
}

}  // namespace

GrootServer::GrootServer(const Options& options) : options_(options), sockets_(std::make_unique<Sockets>()) {
  sockets_->socket.set(zmq::sockopt::linger, 0);
  sockets_->socket.bind(options.port == 0 ? "tcp://127.0.0.1:*"
                                          : fmt::format("tcp://127.0.0.1:{}", options.port));
  const std::string bound = sockets_->socket.get(zmq::sockopt::last_endpoint);
  port_ = std::stoi(bound.substr(bound.rfind(':') + 1));
  thread_ = std::thread([this] { Serve(); });
}

GrootServer::~GrootServer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  sockets_->context.shutdown();  // ends a pending receive
  thread_.join();
}

std::string GrootServer::url() const { return fmt::format("tcp://127.0.0.1:{}", port_); }

std::vector<Value> GrootServer::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

std::vector<int> GrootServer::batches() const {
  const std::lock_guard lock(mutex_);
  return batches_;
}

void GrootServer::AnswerNextWith(const std::string& endpoint, const Bytes& frame) {
  const std::lock_guard lock(mutex_);
  fates_[endpoint].push({Fate::kSay, frame});
}

void GrootServer::BeSilentNext(const std::string& endpoint) {
  const std::lock_guard lock(mutex_);
  fates_[endpoint].push({Fate::kSilent, {}});
}

void GrootServer::BeGoneNext(const std::string& endpoint) {
  const std::lock_guard lock(mutex_);
  fates_[endpoint].push({Fate::kGone, {}});
}

void GrootServer::Serve() {
  zmq::socket_t& socket = sockets_->socket;
  try {
    while (true) {
      zmq::message_t message;
      if (!socket.recv(message)) continue;
      const Value request = policy::DecodeGroot({message.data<uint8_t>(), message.size()});
      std::optional<Fate> fate;
      {
        std::unique_lock lock(mutex_);
        requests_.push_back(request);
        auto& fates = fates_[*request.Find("endpoint")->As<std::string>()];
        if (!fates.empty()) {
          fate = fates.front();
          fates.pop();
        }
        if (fate && fate->kind == Fate::kSilent) {
          stop_.wait(lock, [&] { return stopping_; });
          break;
        }
      }
      if (fate && fate->kind == Fate::kGone) break;
      const Bytes reply = fate ? fate->frame : policy::EncodeGroot(Answer(request));
      socket.send(zmq::buffer(reply));
    }
  } catch (const zmq::error_t&) {  // the context has been shut down
  }
  socket.close();
}

Value GrootServer::Answer(const Value& request) {
  try {
    if (!options_.token.empty()) {
      const Value* token = request.Find("api_token");
      Demand(token && *token == Value(options_.token), "Unauthorized: Invalid API token");
    }
    const std::string endpoint = *request.Find("endpoint")->As<std::string>();
    if (endpoint == "ping") return Map{{"status", "ok"}, {"message", "Server is running"}};
    if (endpoint == "get_modality_config") return Configuration();
    const Value* data = request.Find("data");
    if (endpoint == "get_action") return Act(data ? *data : Value());
    if (endpoint == "reset" && options_.dialect != Dialect::kN15) {
      Demand(data && data->Find("options"), "reset without options");
      return Map{};
    }
    throw std::runtime_error("Unknown endpoint: " + endpoint);
  } catch (const std::runtime_error& error) {
    return Map{{"error", error.what()}};
  }
}

Value GrootServer::Configuration() const {
  if (options_.configuration == Options::Configuration::kNone) return Map{};
  const bool prefixed = options_.dialect == Dialect::kN15;
  List horizon;
  for (int i = 0; i < options_.horizon; ++i) horizon.push_back(i);
  const auto modality = [&](const std::string& name, const std::vector<std::string>& keys,
                            const List& indices) {
    List names;
    for (const std::string& key : keys)
      names.push_back(prefixed && name != "language" ? name + "." + key : key);
    const Map content = {{"delta_indices", indices}, {"modality_keys", names}};
    Map marked = {{"__ModalityConfig_class__", true}};
    switch (options_.configuration) {
      case Options::Configuration::kJsonText:
        marked.emplace_back("as_json", policy::EncodeJsonNumpy(content));
        break;
      case Options::Configuration::kDict:
        marked.emplace_back("as_dict", content);
        break;
      default:
        marked.emplace_back("as_json", content);
    }
    return std::pair<std::string, Value>(name, marked);
  };
  return Map{modality("video", {"front"}, {0}), modality("state", {"arm", "gripper"}, {0}),
             modality("action", {"arm", "gripper"}, horizon), modality("language", {kLanguage}, {0})};
}

Value GrootServer::Act(const Value& data) {
  const bool n15 = options_.dialect == Dialect::kN15, nested = options_.dialect == Dialect::kN16;
  const Value* observation = n15 ? &data : data.Find("observation");
  Demand(observation && (n15 || data.Find("options")), "get_action takes observation and options");
  const auto part = [&](const char* modality) -> const Value& {
    if (!nested) return *observation;
    Demand(observation->Find(modality), fmt::format("Observation must contain a '{}' key", modality));
    return *observation->Find(modality);
  };
  const std::string video = nested ? "" : "video.", state = nested ? "" : "state.";
  // N1.5 also accepts one observation without a batch dimension.
  const Value* state_of_arm = part("state").Find(state + "arm");
  const Array* any = state_of_arm ? state_of_arm->As<Array>() : nullptr;
  const bool is_bare = n15 && any && any->shape.size() == 2;
  const size_t batch = is_bare ? 0 : 1;
  const Array& front = ArrayOf(part("video"), video + "front", "|u1", 4 + batch);
  Demand(front.shape.back() == 3 && front.shape[batch] == 1, "front is not an image");
  const Array& arm = ArrayOf(part("state"), state + "arm", "<f4", 2 + batch);
  const Array& gripper = ArrayOf(part("state"), state + "gripper", "<f4", 2 + batch);
  Demand(gripper.shape.back() == 1 && gripper.shape[batch] == 1, "gripper is not a number");
  const int64_t size = is_bare ? 1 : arm.shape[0], horizon = options_.horizon, length = arm.shape.back();
  Demand(is_bare || (front.shape[0] == size && gripper.shape[0] == size), "not one batch");
  const Value* language = part("language").Find(kLanguage);
  Demand(language, fmt::format("Key '{}' must be in observation", kLanguage));
  const List* texts = language->As<List>();
  Demand(texts && static_cast<int64_t>(texts->size()) == size, "language is not a list of the batch");
  for (const Value& text : *texts) {
    const List* inner = text.As<List>();
    Demand(nested ? inner && inner->size() == 1 && inner->front().Is<std::string>() : text.Is<std::string>(),
           "language has no text");
  }

  const std::vector<double> now = policy::Numbers(arm), levels = policy::Numbers(front);
  std::vector<double> arms, grippers;
  for (int64_t n = 0; n < size; ++n) {
    const auto pixels = static_cast<std::ptrdiff_t>(levels.size()) / size;
    const double seen = std::accumulate(levels.begin() + n * pixels, levels.begin() + (n + 1) * pixels, 0.0);
    for (int64_t i = 0; i < horizon; ++i) {
      for (int64_t j = 0; j < length; ++j) {
        const double at = now[static_cast<size_t>(n * length + j)];
        Demand(std::isfinite(at), "Observation is not finite");
        arms.push_back(at + static_cast<double>(i) * options_.step + options_.per_level * seen);
      }
      grippers.push_back(static_cast<double>(i));
    }
  }
  {
    std::unique_lock lock(mutex_);
    batches_.push_back(static_cast<int>(size));
    if (options_.least_delay.count() > 0) {
      using Duration = std::chrono::steady_clock::duration;
      const Duration since = std::chrono::steady_clock::now() - last_answer_;
      stop_.wait_for(lock, std::clamp<Duration>(2 * since, options_.least_delay, kLongestDelay),
                     [&] { return stopping_; });
    }
    last_answer_ = std::chrono::steady_clock::now();
  }
  Array arm_action = policy::FloatArray(arms, {size, horizon, length});
  Array gripper_action = policy::FloatArray(grippers, {size, horizon, 1});
  if (is_bare) {
    arm_action = Squeezed(arm_action);
    gripper_action = Squeezed(gripper_action);
  }
  const std::string action = nested ? "" : "action.";
  Map actions = {{action + "arm", arm_action}, {action + "gripper", gripper_action}};
  if (n15) return actions;
  return List{Value(std::move(actions)), Value(Map{})};
}

}  // namespace evalbus::doubles
