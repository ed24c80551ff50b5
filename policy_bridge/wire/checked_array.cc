#include <fmt/format.h>

#include <algorithm>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

Array CheckedArray(Array array) {
  const size_t item_size = ItemSize(array.dtype);
  if (item_size == 0) {
    throw ServerError(ServerError::Kind::kProtocol, Describe(array) + ": this number type is not supported");
  }
  const std::optional<size_t> count = ItemCount(array.shape);
  if (!count || array.data.size() % item_size != 0 || array.data.size() / item_size != *count) {
    throw ServerError(ServerError::Kind::kProtocol,
                      fmt::format("{} has {} bytes of data, which do not fit its type and shape",
                                  Describe(array), array.data.size()));
  }
  if (array.dtype[0] == '>') {
    for (size_t at = 0; at < array.data.size(); at += item_size) {
      std::reverse(&array.data[at], &array.data[at] + item_size);
    }
  }
  array.dtype[0] = item_size == 1 ? '|' : '<';
  return array;
}

}  // namespace evalbus::policy
