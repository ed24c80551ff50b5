// Decodes arbitrary bytes as a .npy file. Encoding and decoding the array again must not change it.
#include <cstdlib>

#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(npy) {
  using namespace evalbus::policy;
  try {
    const Array array = DecodeNpy({data, size});
    if (array.data.size() > size || DecodeNpy(EncodeNpy(array)) != array) std::abort();
  } catch (const ServerError&) {
  }
  return 0;
}
