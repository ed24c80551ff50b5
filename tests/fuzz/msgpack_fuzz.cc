// Decodes arbitrary bytes as the message of a policy server. Encoding and decoding a decoded message again
// must not change it.
#include <cstdlib>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(msgpack) {
  using namespace evalbus::policy;
  Value value;
  try {
    value = DecodeMsgpack({data, size});
  } catch (const ServerError&) {
    return 0;
  }
  Describe(value);
  if (const Array* array = value.As<Array>()) Numbers(*array);
  for (const ArrayKeys keys : {ArrayKeys::kBytes, ArrayKeys::kTexts, ArrayKeys::kMsgpackNumpy}) {
    const Bytes written = EncodeMsgpack(value, keys);
    if (EncodeMsgpack(DecodeMsgpack(written), keys) != written) std::abort();
  }
  return 0;
}
