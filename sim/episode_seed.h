// The random numbers of an episode: all drawn from the episode's seed, alike on every machine and compiler
// (the standard library's distributions are not).
#pragma once

#include <cstdint>

namespace evalbus {

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
