// Reads arbitrary bytes as a safetensors file. Writing and reading the content again must not change it.
#include <cstdlib>

#include "base/errors.h"
#include "base/safetensors.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(safetensors) {
  using namespace evalbus;
  try {
    const Safetensors content = ParseSafetensors({data, size}, "x");
    size_t total = 0;
    for (const auto& [name, tensor] : content.tensors) total += tensor.data.size();
    if (total > size) std::abort();
    const std::string bytes = EncodeSafetensors(content);
    const Safetensors again =
        ParseSafetensors({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, "x");
    if (again.tensors.size() != content.tensors.size()) std::abort();
    for (const auto& [name, tensor] : content.tensors)
      tensor.dtype == "F64" ? (void)tensor.Numbers() : (void)0;
  } catch (const InputError&) {
  }
  return 0;
}
