// Half of the mutations are libFuzzer's own, and half come from mutate.h.
#include <algorithm>

#include "tests/fuzz/mutate.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
  if (seed % 2 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::string text = evalbus::Mutate({reinterpret_cast<const char*>(data), size}, seed);
  std::copy_n(text.begin(), std::min(text.size(), max_size), data);
  return std::min(text.size(), max_size);
}
