// The random numbers of an episode: all drawn from its seed, equal on every machine and library (those of std
// distributions are not).
#pragma once

#include <cstdint>
#include <random>

namespace evalbus {

// Mersenne twister, whose output the C++ standard fixes; distributions written out here.
class Random {
 public:
  // stream: independent numbers for different purposes of one episode (0: the reset; policies from 1).
  Random(int64_t seed, uint32_t stream) {
    std::seed_seq sequence{static_cast<uint32_t>(seed),
                           static_cast<uint32_t>(static_cast<uint64_t>(seed) >> 32), stream};
    engine_.seed(sequence);
  }

  // Uniform in [lower, upper), with 53 random bits.
  double Uniform(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

  // Uniform in 0 .. n-1. The bias of the remainder is below n / 2^64.
  int Index(int n) { return static_cast<int>(engine_() % static_cast<uint64_t>(n)); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace evalbus
