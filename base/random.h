// The random numbers of an episode: all drawn from its seed, equal on every machine and library (those of std
// distributions are not).
#pragma once

#include <cstdint>
#include <random>

namespace evalbus {

// Streams of Random: the reset is 0, policies count from 1, these are far from both.
inline constexpr uint32_t kPhysicsStream = 0x10000;
inline constexpr uint32_t kAppearanceStream = 0x10001;
inline constexpr uint32_t kDistractorStream = 0x10002;

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

// Seed of an episode from the run's seed and the episode's index alone, so that any episode can be run alone,
// anywhere and in any order (SplitMix64's finaliser: Steele, Lea, Flood 2014). 53 bits, so that JSON readers
// that know only doubles keep it exact.
inline int64_t EpisodeSeed(int64_t run_seed, int32_t episode) {
  uint64_t z = static_cast<uint64_t>(run_seed) + 0x9E3779B97F4A7C15u * (static_cast<uint64_t>(episode) + 1);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return static_cast<int64_t>((z ^ (z >> 31)) >> 11);
}

}  // namespace evalbus
