// FUZZ_TARGET(name) { ... } defines a fuzz target: a function of `data` and `size` that returns 0 and aborts
// if the input reveals a defect. With EVALBUS_FUZZ, libFuzzer calls it. Otherwise it is one of the targets
// that run_corpus.cc runs.
#pragma once

#include <cstddef>
#include <cstdint>

#ifdef EVALBUS_FUZZ

#define FUZZ_TARGET(name) extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)

#else

namespace evalbus {

using FuzzTarget = int (*)(const uint8_t* data, size_t size);
// Makes the target known to run_corpus.cc. Returns true.
bool AddFuzzTarget(const char* name, FuzzTarget target);

}  // namespace evalbus

#define FUZZ_TARGET(name)                                                         \
  static int Fuzz_##name(const uint8_t* data, size_t size);                       \
  static const bool is_added_##name = evalbus::AddFuzzTarget(#name, Fuzz_##name); \
  static int Fuzz_##name([[maybe_unused]] const uint8_t* data, [[maybe_unused]] size_t size)

#endif
