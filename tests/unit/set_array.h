// Sets an array in a message, which C++ cannot assign.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace evalbus {

template <size_t kSize>
void Set(double (*to)[kSize], const std::array<double, kSize>& values) {
  std::ranges::copy(values, *to);
}

}  // namespace evalbus
