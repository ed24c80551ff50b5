#include "tests/unit/allocation_count.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<int64_t> count = 0, bytes = 0;
}

namespace evalbus {
int64_t AllocationCount() { return count; }
int64_t AllocatedBytes() { return bytes; }
}  // namespace evalbus

// A separate file, so that the compiler does not inline one operator of the pair and warn about the other.
void* operator new(size_t size, const std::nothrow_t&) noexcept {
  ++count;
  bytes += static_cast<int64_t>(size);
  return std::malloc(size);
}
void* operator new(size_t size) {
  if (void* memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
