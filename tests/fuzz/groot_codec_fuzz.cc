// Decodes any bytes as a message of a GR00T server. Encoding and decoding a decoded message again does not
// change it. Only configurations may be encoded differently, with the same content.
#include <cstdlib>
#include <string_view>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(groot_codec) {
  using namespace evalbus::policy;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const Value value = DecodeGroot({data, size});
    if (text.find("__ModalityConfig_class__") != std::string_view::npos) return 0;
    const Bytes written = EncodeGroot(value);
    if (EncodeGroot(DecodeGroot(written)) != written) std::abort();
  } catch (const ServerError&) {
  }
  return 0;
}
