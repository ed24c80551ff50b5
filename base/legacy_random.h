// Produces exactly the random numbers of NumPy's legacy generator (np.random.seed), which RoboEval's scenes
// use.
#pragma once

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace evalbus {

class LegacyRandom {
 public:
  // Equals np.random.seed(seed).
  explicit LegacyRandom(uint32_t seed) : engine_(seed) {}

  // Equals np.random.random_sample(): 53 bits from two words of the engine.
  double Double() {
    const uint32_t a = engine_() >> 5, b = engine_() >> 6;
    return (a * 67108864.0 + b) / 9007199254740992.0;
  }
  // Equals np.random.uniform(lower, upper).
  double Uniform(double lower, double upper) { return lower + (upper - lower) * Double(); }

  // Equals np.random.permutation(n). Its first k elements equal np.random.choice(n, k, replace=False).
  std::vector<int> Permutation(int n) {
    std::vector<int> result(static_cast<size_t>(n));
    for (int i = 0; i < n; ++i) result[static_cast<size_t>(i)] = i;
    for (int i = n - 1; i > 0; --i) {
      std::swap(result[static_cast<size_t>(i)], result[UpTo(static_cast<uint32_t>(i))]);
    }
    return result;
  }

 private:
  // Returns a uniform number in 0 .. most, by masked rejection.
  size_t UpTo(uint32_t most) {
    uint32_t mask = most;
    for (int shift = 1; shift < 32; shift *= 2) mask |= mask >> shift;
    uint32_t value = 0;
    do {
      value = static_cast<uint32_t>(engine_()) & mask;
    } while (value > most);
    return value;
  }
  std::mt19937 engine_;
};

}  // namespace evalbus
