// Client of NVIDIA Isaac-GR00T's inference servers, N1.5 to N1.7, over ZeroMQ.
//
// The interface is the same for every dialect. An observation is a map of "video.NAME" (|u1, (T, height,
// width, 3)), "state.NAME" (numbers, (T, D)) and language keys (text). The key of an action in an answer is
// NAME, and its shape is (H, D). In the map of modalities that Connect() returns, names of video, state and
// action have no prefix. An N1.5 server lists "video.NAME" under video, so the prefix is removed. The key of
// an observation is therefore MODALITY.NAME in all dialects. Language keys are the server's keys; they are
// not changed, even if they contain dots.
//
// Deadlines: connect_s for the connection, first_reply_s for the first actions, reply_s for all other
// answers. The protocol allows any client to stop the server, but this client never sends that request.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/text.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/url.h"
#include "policy_bridge/wire/zeromq.h"

namespace evalbus::policy {
namespace {

using Kind = ServerError::Kind;
using Dialect = ClientOptions::GrootDialect;
constexpr std::string_view kVideo = "video.", kState = "state.", kAction = "action.";

// Observations of one request. All maps have the same keys.
using Batch = std::vector<Map>;

// Returns whether the observations fit into one request. Their keys must be equal and in the same order, and
// arrays must have the same dtype and shape.
bool FitTogether(const Batch& batch) {
  return std::ranges::all_of(batch, [&](const Map& observation) {
    return std::ranges::equal(observation, batch.front(), [](const auto& one, const auto& other) {
      const Array *array = one.second.template As<Array>(), *same = other.second.template As<Array>();
      return one.first == other.first && (array != nullptr) == (same != nullptr) &&
             (!array || (array->dtype == same->dtype && array->shape == same->shape));
    });
  });
}

// Stacks the i-th entries of all observations: arrays of shape (...) become one array of shape (observations,
// ...).
Array Stacked(const Batch& batch, size_t i) {
  Array stacked = *batch.front()[i].second.As<Array>();
  stacked.shape.insert(stacked.shape.begin(), static_cast<int64_t>(batch.size()));
  for (size_t b = 1; b < batch.size(); ++b) {
    const Bytes& data = batch[b][i].second.As<Array>()->data;
    stacked.data.insert(stacked.data.end(), data.begin(), data.end());
  }
  return stacked;
}

// Returns the n-th array, of shape (...), of an array of shape (observations, ...).
Array Nth(const Array& stacked, size_t n) {
  Array one{stacked.dtype, {stacked.shape.begin() + 1, stacked.shape.end()}, {}};
  const size_t size = stacked.data.size() / static_cast<size_t>(stacked.shape[0]);
  const auto begin = stacked.data.begin() + static_cast<std::ptrdiff_t>(n * size);
  one.data.assign(begin, begin + static_cast<std::ptrdiff_t>(size));
  return one;
}

// Checks an entry of an observation and returns it in the form common to all dialects, without the batch
// axis.
Value Checked(const std::string& key, const Value& value) {
  const Array* array = value.As<Array>();
  if (key.starts_with(kVideo)) {
    if (!array || array->dtype != "|u1" || array->shape.size() != 4 || array->shape[3] != 3) {
      throw InputError(
          fmt::format("observation {}: {}, expected |u1 [frames, height, width, 3]", key, Describe(value)));
    }
    return value;
  }
  if (key.starts_with(kState)) {
    if (!array || array->shape.size() != 2 || ItemSize(array->dtype) == 0) {
      throw InputError(
          fmt::format("observation {}: {}, expected numbers [times, length]", key, Describe(value)));
    }
    return array->dtype == "<f4" ? *array : FloatArray(Numbers(*array), array->shape);
  }
  if (!value.Is<std::string>()) {
    throw InputError(
        fmt::format("observation {}: {}, expected a string, or a key \"video.NAME\" or \"state.NAME\"", key,
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
      Open();
      answered_ = false;
      horizon_.reset();
      dialect_ = options_.groot_dialect;
      CheckMap("ping", Call("ping", {}, options_.reply_s));
      Value configuration = Call("get_modality_config", {}, options_.reply_s);
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
    if (dialect_ == Dialect::kN15) return;  // N1.5 servers keep no state
    ClosedByFailure([&] { return Call("reset", Map{{"options", nullptr}}, options_.reply_s); });
  }

  Reply Infer(const Value& observation) override { return InferBatch({&observation, 1}).front(); }

  std::vector<Reply> InferBatch(std::span<const Value> observations) override {
    return ClosedByFailure([&] {
      Batch batch;
      for (const Value& observation : observations) {
        if (!observation.Is<Map>())
          throw InputError("observation: expected a map, got " + Describe(observation));
        batch.push_back(*observation.As<Map>());
        for (auto& [key, value] : batch.back()) value = Checked(key, value);
      }
      if (FitTogether(batch)) return InferTogether(batch);
      std::vector<Reply> replies;
      for (const Map& one : batch) replies.push_back(InferTogether({one}).front());
      return replies;
    });
  }

  std::string Name() const override {
    return dialect_ == Dialect::kN15       ? "GR00T N1.5"
           : dialect_ == Dialect::kN16     ? "GR00T N1.6"
           : dialect_ == Dialect::kN16Flat ? "GR00T N1.6 (flat)"
                                           : "GR00T";
  }

 private:
  // Returns talk(). If it fails without an error message from the server, the connection is closed, because
  // the next frame might belong to an earlier request.
  template <class Talk>
  auto ClosedByFailure(const Talk& talk) -> decltype(talk()) {
    try {
      return talk();
    } catch (const ServerError& error) {
      if (error.kind() != Kind::kServer) connection_.reset();
      throw;
    }
  }

  // Connects to the first address of the host at which a server listens.
  void Open() {
    const Url url = ParseUrl(options_.url, "tcp");
    const std::vector<std::string> addresses = Resolve(url, options_.connect_s);
    for (const std::string& address : addresses) {
      try {
        connection_.emplace("tcp://" + HostAndPort(address, url.port), options_.connect_s,
                            options_.max_reply_bytes);
        return;
      } catch (const ServerError& error) {
        if (error.kind() != Kind::kUnreachable || &address == &addresses.back()) throw;
      }
    }
  }

  std::vector<Reply> InferTogether(const Batch& batch) {
    Value answer;
    try {
      answer = GetAction(batch);
    } catch (const ServerError& error) {
      if (dialect_ != Dialect::kDetect || !RequestsFlat(error, batch.front())) throw;
      dialect_ = Dialect::kN16Flat;
      answer = GetAction(batch);
    }
    if (dialect_ == Dialect::kDetect) dialect_ = Dialect::kN16;
    answered_ = true;
    return Actions(std::move(answer), batch.size());
  }

  Value Call(const std::string& endpoint, std::optional<Value> data, double limit_s) {
    if (!connection_) throw ServerError(Kind::kUnreachable, options_.url + ": not connected");
    Map request = {{"endpoint", endpoint}};
    if (data) request.emplace_back("data", std::move(*data));
    if (!options_.api_key.empty()) request.emplace_back("api_token", options_.api_key);
    const Bytes reply = connection_->Call(EncodeGroot(request), limit_s);
    // The oldest servers answer every failure with the word "ERROR".
    constexpr std::string_view kError = "ERROR";
    if (std::equal(reply.begin(), reply.end(), kError.begin(), kError.end())) throw ErrorFromServer("ERROR");
    Value answer = DecodeGroot(reply);
    if (const Value* error = answer.Find("error")) throw ErrorFromServer(TextOrDescription(*error));
    return answer;
  }

  static void CheckMap(const std::string& endpoint, const Value& answer) {
    if (answer.Is<Map>()) return;
    throw ServerError(Kind::kServer, fmt::format("the server answers {} with {}, expected a map", endpoint,
                                                 Describe(answer)));
  }

  // Removes the prefixes of names. They also identify the dialect.
  void ReadConfiguration(Map& configuration) {
    bool prefixed = false;
    for (auto& [modality, content] : configuration) {
      if (!content.Find("modality_keys") || !content.Find("modality_keys")->Is<List>()) {
        throw ServerError(
            Kind::kReply,
            fmt::format("modality configuration: {}: expected a map with a list modality_keys, got {}",
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

  // Uses kN16 until an answer shows that the server uses a different dialect. For N1.5, a single observation
  // has no batch axis; all other requests have one.
  Value GetAction(const Batch& batch) {
    Map video, state, language, flat;
    for (size_t i = 0; i < batch.front().size(); ++i) {
      const auto& [key, value] = batch.front()[i];
      if (!value.Is<Array>()) {
        List texts, nested;
        for (const Map& observation : batch) {
          texts.push_back(observation[i].second);
          nested.push_back(List{observation[i].second});
        }
        flat.emplace_back(key, std::move(texts));
        language.emplace_back(key, std::move(nested));
        continue;
      }
      const bool is_bare = dialect_ == Dialect::kN15 && batch.size() == 1;
      flat.emplace_back(key, is_bare ? value : Value(Stacked(batch, i)));
      (key.starts_with(kVideo) ? video : state)
          .emplace_back(key.substr((key.starts_with(kVideo) ? kVideo : kState).size()), flat.back().second);
    }
    Value sent = flat;
    if (dialect_ != Dialect::kN15) {
      if (dialect_ != Dialect::kN16Flat) {
        flat = {{"video", std::move(video)}, {"state", std::move(state)}, {"language", std::move(language)}};
      }
      sent = Map{{"observation", std::move(flat)}, {"options", nullptr}};
    }
    return Call("get_action", std::move(sent), answered_ ? options_.reply_s : options_.first_reply_s);
  }

  // Returns whether an error shows that the server expects flat observations. Such a server reports a missing
  // key with its prefix; a server that expects nested observations reports it without the prefix.
  static bool RequestsFlat(const ServerError& error, const Map& entries) {
    if (error.kind() != Kind::kServer) return false;
    for (const auto& [key, value] : entries) {
      if (value.Is<Array>() && error.details().find(key) != std::string::npos) return true;
    }
    return false;
  }

  // Returns the actions for each observation of the batch.
  std::vector<Reply> Actions(Value answer, size_t batch_size) const {
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
    std::vector<Map> actions(batch_size);
    for (auto& [key, value] : *answer.As<Map>()) {
      const Array* array = value.As<Array>();
      if (!array) continue;
      const std::string name = key.starts_with(kAction) ? key.substr(kAction.size()) : key;
      if (batch_size == 1) {
        actions[0].emplace_back(name, WithoutBatch(key, *array));
        continue;
      }
      if (array->shape.size() != 3 || array->shape[0] != static_cast<int64_t>(batch_size)) {
        throw ServerError(Kind::kReply, fmt::format("action {} is {}, not [{}, steps, length]",
                                                    Printable(key), Describe(*array), batch_size));
      }
      for (size_t n = 0; n < batch_size; ++n) actions[n].emplace_back(name, Nth(*array, n));
    }
    if (actions[0].empty())
      throw ServerError(Kind::kReply, "the server answers an observation without any action");
    std::vector<Reply> replies;
    for (Map& map : actions) replies.push_back({std::move(map), {}});
    return replies;
  }

  // Converts an array (1, H, D) or (H, D) to (H, D). N1.5 omits every axis of size 1.
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
  Dialect dialect_;  // kDetect until an answer has shown the dialect
  std::optional<size_t> horizon_;
  bool answered_ = false;
  std::optional<RequestSocket> connection_;
};

}  // namespace

std::unique_ptr<PolicyClient> MakeGrootClient(const ClientOptions& options) {
  return std::make_unique<GrootClient>(options);
}

}  // namespace evalbus::policy
