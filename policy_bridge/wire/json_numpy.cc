#include <fmt/format.h>
#include <openssl/evp.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/base64.h"
#include "base/errors.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/tree_builder.h"

namespace evalbus::policy {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void RefuseJson(const std::string& why) {
  throw ServerError(ServerError::Kind::kProtocol, "JSON: " + why);
}

// Largest input of a single call of OpenSSL's function, whose lengths are of type int.
constexpr size_t kMaxBase64 = std::numeric_limits<int>::max() / 4 * 3;

Bytes DecodeBase64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  // These checks are necessary because OpenSSL's function would accept spaces, and padding in any position.
  const size_t digits = std::min(text.find_first_not_of(kDigits), text.size());
  const size_t padding = text.size() - digits;
  if (text.size() % 4 != 0 || padding > 2 ||
      text.substr(digits) != std::string_view("==").substr(0, padding) || text.size() > kMaxBase64) {
    RefuseJson("an array's bytes are not base64");
  }
  Bytes bytes(text.size() / 4 * 3);
  EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(text.data()),
                  static_cast<int>(text.size()));
  bytes.resize(bytes.size() - padding);
  return bytes;
}

struct ToJson {
  Json operator()(std::nullptr_t) const { return nullptr; }
  Json operator()(bool truth) const { return truth; }
  Json operator()(int64_t number) const { return number; }
  Json operator()(double number) const {
    if (!std::isfinite(number)) throw InputError("a number that is not finite cannot be sent as JSON");
    return number;
  }
  Json operator()(const std::string& text) const { return text; }
  Json operator()(const Bytes&) const { throw InputError("bytes cannot be sent as JSON"); }
  Json operator()(const Array& array) const {
    return {{"__numpy__", Base64(array.data)}, {"dtype", array.dtype}, {"shape", array.shape}};
  }
  Json operator()(const List& list) const {
    Json json = Json::array();
    for (const Value& value : list) json.push_back(std::visit(*this, value.variant()));
    return json;
  }
  Json operator()(const Map& map) const {
    Json json = Json::object();
    for (const auto& [key, value] : map) json[key] = std::visit(*this, value.variant());
    return json;
  }
};

// Returns the value that a map represents.
Value JsonMeaning(Map map) {
  Value value = std::move(map);
  const Value* data = value.Find("__numpy__");
  if (!data) return value;
  const Value* dtype = value.Find("dtype");
  const Value* shape = value.Find("shape");
  if (!data->Is<std::string>() || !dtype || !dtype->Is<std::string>() || !shape || !shape->Is<List>()) {
    RefuseJson("an array: expected text \"__numpy__\", text \"dtype\" and a list \"shape\"");
  }
  Array array{*dtype->As<std::string>(), {}, {}};
  for (const Value& length : *shape->As<List>()) {
    if (!length.Is<int64_t>()) RefuseJson("an array's shape is not a list of integers");
    array.shape.push_back(*length.As<int64_t>());
  }
  array.data = DecodeBase64(*data->As<std::string>());
  return CheckedArray(std::move(array));
}

// Handles the events of nlohmann's parser. nlohmann's own tree is not used, because its memory has no limit.
class Reader : public nlohmann::json_sax<Json> {
 public:
  Value Take() { return tree_.Take(); }

  bool null() override { return tree_.Add(nullptr); }
  bool boolean(bool truth) override { return tree_.Add(truth); }
  bool number_integer(int64_t number) override { return tree_.Add(number); }
  bool number_unsigned(uint64_t number) override {
    if (number > std::numeric_limits<int64_t>::max())
      RefuseJson(fmt::format("{} is too large an integer", number));
    return tree_.Add(static_cast<int64_t>(number));
  }
  bool number_float(double number, const std::string&) override { return tree_.Add(number); }
  bool string(std::string& text) override { return tree_.Add(std::move(text)); }
  bool binary(Json::binary_t&) override { return false; }  // JSON has none
  bool start_object(size_t) override { return tree_.Open(Map{}); }
  bool key(std::string& key) override { return tree_.SetKey(std::move(key)); }
  bool end_object() override { return tree_.CloseMap(JsonMeaning); }
  bool start_array(size_t) override { return tree_.Open(List{}); }
  bool end_array() override { return tree_.CloseList(); }
  bool parse_error(size_t position, const std::string&, const nlohmann::detail::exception&) override {
    RefuseJson(fmt::format("malformed at byte {}", position));
  }

 private:
  TreeBuilder tree_{"JSON"};
};

}  // namespace

std::string EncodeJsonNumpy(const Value& value) {
  const Json json = std::visit(ToJson{}, value.variant());
  try {
    return json.dump();
  } catch (const Json::type_error&) {
    throw InputError("text that is not UTF-8 cannot be sent as JSON");
  }
}

Value DecodeJsonNumpy(std::string_view text) {
  Reader reader;
  Json::sax_parse(text, &reader);
  return reader.Take();
}

}  // namespace evalbus::policy
