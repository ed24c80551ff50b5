#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <msgpack.hpp>
#include <string>

#include "base/text.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "policy_bridge/wire/tree_builder.h"

namespace evalbus::policy {
namespace {

[[noreturn]] void RefuseMsgpack(const std::string& why) {
  throw ServerError(ServerError::Kind::kProtocol, "MessagePack: " + why);
}

class Encoder {
 public:
  explicit Encoder(ArrayKeys array_keys) : array_keys_(array_keys) {}

  Bytes Encode(const Value& value) {
    Pack(value);
    return std::move(stream_.bytes);
  }

 private:
  struct Stream {
    Bytes bytes;
    void write(const char* data, size_t size) { bytes.insert(bytes.end(), data, data + size); }
  };

  void Pack(const Value& value) {
    std::visit([this](const auto& held) { Pack(held); }, value.variant());
  }
  void Pack(std::nullptr_t) { packer_.pack_nil(); }
  void Pack(bool truth) { truth ? packer_.pack_true() : packer_.pack_false(); }
  void Pack(int64_t number) { packer_.pack_int64(number); }
  // The library would encode 1.0 as the integer 1, and servers would interpret it as an integer.
  void Pack(double number) {
    stream_.bytes.push_back(0xcb);
    const auto bits = std::bit_cast<uint64_t>(number);
    for (int shift = 56; shift >= 0; shift -= 8) stream_.bytes.push_back(static_cast<uint8_t>(bits >> shift));
  }
  void Pack(const std::string& text) {
    packer_.pack_str(Length(text.size()));
    packer_.pack_str_body(text.data(), Length(text.size()));
  }
  void Pack(const Bytes& bytes) {
    packer_.pack_bin(Length(bytes.size()));
    packer_.pack_bin_body(reinterpret_cast<const char*>(bytes.data()), Length(bytes.size()));
  }
  void Pack(const List& list) {
    packer_.pack_array(Length(list.size()));
    for (const Value& value : list) Pack(value);
  }
  void Pack(const Map& map) {
    packer_.pack_map(Length(map.size()));
    for (const auto& [key, value] : map) {
      Pack(key);
      Pack(value);
    }
  }
  void Pack(const Array& array) {
    if (array_keys_ == ArrayKeys::kMsgpackNumpy) return PackAsMsgpackNumpy(array);
    packer_.pack_map(4);
    PackArrayKey("__ndarray__");
    Pack(true);
    PackArrayKey("data");
    Pack(array.data);
    PackArrayKey("dtype");
    Pack(array.dtype);
    PackArrayKey("shape");
    PackShape(array);
  }
  void PackAsMsgpackNumpy(const Array& array) {
    packer_.pack_map(5);
    PackBytesKey("nd");
    Pack(true);
    PackBytesKey("type");
    Pack(array.dtype);
    PackBytesKey("kind");
    Pack(Bytes());
    PackBytesKey("shape");
    PackShape(array);
    PackBytesKey("data");
    Pack(array.data);
  }
  void PackShape(const Array& array) {
    packer_.pack_array(Length(array.shape.size()));
    for (const int64_t extent : array.shape) Pack(extent);
  }
  void PackBytesKey(std::string_view key) { Pack(Bytes(key.begin(), key.end())); }
  void PackArrayKey(std::string_view key) {
    array_keys_ == ArrayKeys::kBytes ? PackBytesKey(key) : Pack(std::string(key));
  }

  static uint32_t Length(size_t length) {
    if (length > std::numeric_limits<uint32_t>::max()) throw std::length_error("too long for MessagePack");
    return static_cast<uint32_t>(length);
  }

  const ArrayKeys array_keys_;
  Stream stream_;
  msgpack::packer<Stream> packer_{stream_};
};

Value& Part(Map& map, std::string_view key) {
  const auto found = std::ranges::find(map, key, &Map::value_type::first);
  if (found == map.end()) RefuseMsgpack(fmt::format("an array without \"{}\"", key));
  return found->second;
}

bool Has(const Map& map, std::string_view marker) {
  const auto found = std::ranges::find(map, marker, &Map::value_type::first);
  return found != map.end() && found->second == Value(true);
}

// dtype_key: key of the dtype, which is "type" in msgpack-numpy's form.
Value ToArray(Map map, std::string_view dtype_key = "dtype") {
  Array array;
  const Value& dtype = Part(map, dtype_key);
  if (!dtype.Is<std::string>()) RefuseMsgpack("an array's dtype is " + Describe(dtype) + ", expected text");
  array.dtype = *dtype.As<std::string>();
  const Value& shape = Part(map, "shape");
  if (!shape.Is<List>()) RefuseMsgpack("an array's shape is " + Describe(shape) + ", expected a list");
  for (const Value& extent : *shape.As<List>()) {
    if (!extent.Is<int64_t>())
      RefuseMsgpack("an array's shape has " + Describe(extent) + ", expected integers");
    array.shape.push_back(*extent.As<int64_t>());
  }
  Value& data = Part(map, "data");
  if (!data.Is<Bytes>()) RefuseMsgpack("an array's data are " + Describe(data) + ", expected bytes");
  array.data = std::move(*data.As<Bytes>());

  if (array.dtype.size() >= 2 && array.dtype[1] == 'U') return Describe(array) + " of texts is not supported";
  return CheckedArray(std::move(array));
}

// Returns whether a map is an array or a NumPy scalar in msgpack-numpy's form. Its keys are common words, so
// the types of the values are also compared. A structured array, whose "type" is a list, remains a map.
bool IsOfMsgpackNumpy(const Map& map) {
  const auto holds = [&]<class T>(std::string_view key, std::in_place_type_t<T>) {
    const auto found = std::ranges::find(map, key, &Map::value_type::first);
    return found != map.end() && found->second.Is<T>();
  };
  return holds("nd", std::in_place_type<bool>) && holds("type", std::in_place_type<std::string>) &&
         holds("data", std::in_place_type<Bytes>);
}

// Returns the value that a map represents.
Value MsgpackMeaning(Map map) {
  if (IsOfMsgpackNumpy(map)) {
    if (!Has(map, "nd")) map.emplace_back("shape", List());
    return ToArray(std::move(map), "type");
  }
  if (Has(map, "__ndarray__")) return ToArray(std::move(map));
  if (Has(map, "__npgeneric__")) return Part(map, "data");
  return map;
}

// Receives the parser's events in order. A handler ends the parsing by returning false or by throwing an
// exception.
class Builder : public msgpack::null_visitor {
 public:
  bool visit_nil() { return Add(nullptr); }
  bool visit_boolean(bool truth) { return Add(truth); }
  bool visit_positive_integer(uint64_t number) {
    if (number > static_cast<uint64_t>(std::numeric_limits<int64_t>::max()))
      return Add(static_cast<double>(number));
    return Add(static_cast<int64_t>(number));
  }
  bool visit_negative_integer(int64_t number) { return Add(number); }
  bool visit_float32(float number) { return Add(static_cast<double>(number)); }
  bool visit_float64(double number) { return Add(number); }
  bool visit_str(const char* text, uint32_t size) {
    return is_key_ ? tree_.SetKey({text, size}) : tree_.Add(std::string(text, size));
  }
  bool visit_bin(const char* bytes, uint32_t size) {
    return is_key_ ? tree_.SetKey({bytes, size}) : tree_.Add(Bytes(bytes, bytes + size));
  }
  bool visit_ext(const char*, uint32_t) {
    RefuseMsgpack("an extension type, which this wire does not support");
  }

  // Ignores the announced number of elements. Memory is allocated only for elements that have arrived.
  bool start_array(uint32_t) { return Open(List()); }
  bool end_array() { return tree_.CloseList(); }
  bool start_map(uint32_t) { return Open(Map()); }
  bool start_map_key() { return is_key_ = true; }
  bool end_map_key() {
    is_key_ = false;
    return true;
  }
  bool end_map() { return tree_.CloseMap(MsgpackMeaning); }
  void insufficient_bytes(size_t, size_t) { RefuseMsgpack("it is truncated"); }
  void parse_error(size_t, size_t at) { RefuseMsgpack(fmt::format("no valid value starts at byte {}", at)); }

  Value Take() { return tree_.Take(); }

 private:
  bool Open(Value container) {
    CheckKey(container);
    return tree_.Open(std::move(container));
  }

  bool Add(Value value) {
    CheckKey(value);
    return tree_.Add(std::move(value));
  }

  void CheckKey(const Value& value) const {
    if (is_key_) RefuseMsgpack("a key is " + Describe(value) + ", expected text");
  }

  TreeBuilder tree_{"MessagePack"};
  bool is_key_ = false;
};

}  // namespace

Bytes EncodeMsgpack(const Value& value, ArrayKeys array_keys) { return Encoder(array_keys).Encode(value); }

Value DecodeMsgpack(std::span<const uint8_t> bytes) {
  Builder builder;
  size_t parsed = 0;
  try {
    msgpack::parse(reinterpret_cast<const char*>(bytes.data()), bytes.size(), parsed, builder);
  } catch (const msgpack::unpack_error& error) {
    RefuseMsgpack(error.what());
  }
  if (parsed != bytes.size()) RefuseMsgpack(Plural(bytes.size() - parsed, "byte") + " after its end");
  return builder.Take();
}

}  // namespace evalbus::policy
