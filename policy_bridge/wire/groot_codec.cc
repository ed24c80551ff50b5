#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {
namespace {

constexpr const char *kArrayMark = "__ndarray_class__", *kModalityMark = "__ModalityConfig_class__";

// Returns `value` with all arrays replaced by maps.
Value Written(const Value& value) {
  if (const auto* array = value.As<Array>()) return Map{{kArrayMark, true}, {"as_npy", EncodeNpy(*array)}};
  if (const auto* list = value.As<List>()) {
    List written;
    for (const Value& item : *list) written.push_back(Written(item));
    return written;
  }
  if (const auto* map = value.As<Map>()) {
    Map written;
    for (const auto& [key, item] : *map) written.emplace_back(key, Written(item));
    return written;
  }
  return value;
}

bool IsMarked(const Value& value, const char* mark) {
  const Value* found = value.Find(mark);
  return found && *found == Value(true);
}

// Returns `value` with maps replaced by the arrays or modality configurations that they represent.
Value Read(Value value) {
  if (List* list = value.As<List>()) {
    for (Value& item : *list) item = Read(std::move(item));
  } else if (Map* map = value.As<Map>()) {
    for (auto& [key, item] : *map) item = Read(std::move(item));
  }
  if (IsMarked(value, kArrayMark)) {
    const Value* npy = value.Find("as_npy");
    if (!npy || !npy->Is<Bytes>()) {
      throw ServerError(ServerError::Kind::kProtocol, "an array lacks the bytes of its .npy file");
    }
    return DecodeNpy(*npy->As<Bytes>());
  }
  if (IsMarked(value, kModalityMark)) {
    const Value* content = value.Find("as_json");
    if (!content) content = value.Find("as_dict");
    if (content && content->Is<std::string>()) return DecodeJsonNumpy(*content->As<std::string>());
    if (!content || !content->Is<Map>()) {
      throw ServerError(ServerError::Kind::kProtocol, "a modality configuration without its content");
    }
    return Value(*content);
  }
  return value;
}

}  // namespace

Bytes EncodeGroot(const Value& value) { return EncodeMsgpack(Written(value), ArrayKeys::kTexts); }

Value DecodeGroot(std::span<const uint8_t> bytes) { return Read(DecodeMsgpack(bytes)); }

}  // namespace evalbus::policy
