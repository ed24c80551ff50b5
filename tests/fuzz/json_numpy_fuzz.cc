// Decodes arbitrary text as JSON with arrays. Encoding and decoding a decoded value again must not change it.
#include <cstdlib>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(json_numpy) {
  using namespace evalbus::policy;
  try {
    const std::string written = EncodeJsonNumpy(DecodeJsonNumpy({reinterpret_cast<const char*>(data), size}));
    if (EncodeJsonNumpy(DecodeJsonNumpy(written)) != written) std::abort();
  } catch (const ServerError&) {
  }
  return 0;
}
