// The random numbers of an episode. All are drawn from its seed and are equal on every machine and with every
// library, which is not guaranteed for the distributions of std.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <string_view>

namespace evalbus {

// Streams of Random. Stream 0 is used for the reset, and policies use streams from 1 on. These streams are
// far from both.
inline constexpr uint32_t kPhysicsStream = 0x10000;
inline constexpr uint32_t kAppearanceStream = 0x10001;
inline constexpr uint32_t kDistractorStream = 0x10002;
inline constexpr uint32_t kLightStream = 0x10003;
inline constexpr uint32_t kTextureStream = 0x10004;

// A Mersenne twister, whose output the C++ standard fixes, with distributions that are implemented here.
class Random {
 public:
  // stream: selects independent numbers for different purposes of one episode (0: the reset; from 1 on:
  // policies).
  Random(int64_t seed, uint32_t stream) {
    std::seed_seq sequence{static_cast<uint32_t>(seed),
                           static_cast<uint32_t>(static_cast<uint64_t>(seed) >> 32), stream};
    engine_.seed(sequence);
  }

  // Returns a uniform number in [lower, upper), with 53 random bits.
  double Uniform(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

  // Returns a uniform integer in 0 .. n-1. The bias of the remainder is below n / 2^64.
  int Index(int n) { return static_cast<int>(engine_() % static_cast<uint64_t>(n)); }

 private:
  std::mt19937_64 engine_;
};

// Streams of episode seeds (seed_stream in run.json). Evaluation and collection of demonstrations use
// different streams, so that no policy is evaluated at the initial poses on which it was trained. The number
// is the version of SeedSource::OfEpisode.
inline constexpr char kRunSeeds[] = "run/2";
inline constexpr char kCollectSeeds[] = "collect/2";
// The episodes' seeds are --seed, --seed + 1, ..., and each reset state has the poses of RoboEval's
// env.reset(seed=...) (sim/roboeval_start.h). The number is the version of these draws.
inline constexpr char kRoboEvalSeeds[] = "roboeval/1";
inline constexpr int64_t kMaxRoboEvalSeed = 0xFFFFFFFF;
// Version 1 of the seeds. They depend only on the run's seed and the episode's index, so that all tasks, and
// `collect`, share them. Runs that were recorded before seed_stream was introduced have these seeds.
inline constexpr char kSharedSeeds[] = "";

inline bool IsSeedStream(std::string_view name) {
  return name == kRunSeeds || name == kCollectSeeds || name == kRoboEvalSeeds || name == kSharedSeeds;
}

// Values from which the seeds of a run's episodes are derived.
struct SeedSource {
  int64_t seed = 0;
  std::string stream, task, variation;

  // Returns the seed of an episode. It does not depend on other episodes, so that each can be run alone,
  // anywhere and in any order. It has at most 53 bits, so that JSON readers that only support doubles keep it
  // exact.
  int64_t OfEpisode(int32_t episode) const {
    if (stream == kRoboEvalSeeds) return seed + episode;
    uint64_t base = static_cast<uint64_t>(seed);
    if (stream != kSharedSeeds) base = Mix(base ^ Hash(stream + "/" + task + "/" + variation));
    const uint64_t step = 0x9E3779B97F4A7C15u;
    return static_cast<int64_t>(Mix(base + step * (static_cast<uint64_t>(episode) + 1)) >> 11);
  }

 private:
  // Applies the finalizer of SplitMix64 (Steele, Lea, Flood 2014).
  static uint64_t Mix(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  // Returns the FNV-1a hash of a text.
  static uint64_t Hash(std::string_view text) {
    uint64_t hash = 0xCBF29CE484222325u;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3u;
    return hash;
  }
};

}  // namespace evalbus
