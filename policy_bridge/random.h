// Random numbers that are equal on every platform and library (those of std distributions are not).
#pragma once

#include <cstdint>
#include <random>

namespace evalbus {

// Mersenne twister, whose output the C++ standard fixes; distributions written out here.
class Random {
 public:
  // stream: independent numbers for different purposes of one episode.
  Random(int64_t seed, uint32_t stream) {
    std::seed_seq sequence{static_cast<uint32_t>(seed),
                           static_cast<uint32_t>(static_cast<uint64_t>(seed) >> 32), stream};
    engine_.seed(sequence);
  }

  // Uniform in [lower, upper).
  double Uniform(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace evalbus
