// How often a sim, or what stands in its place, says again what others may have missed.
#pragma once

#include <chrono>
#include <cstdint>

namespace evalbus::sim {

// EPISODE_BEGIN, until all are ready.
inline constexpr auto kAnnouncePeriod = std::chrono::milliseconds(200);
// MODEL is repeated while an episode runs, for those who begin to listen in its middle: by the wall clock
// where policies are slow, by simulated time so that the log of a run that was faster than time has it, too.
inline constexpr auto kRepeatModel = std::chrono::seconds(1);
inline constexpr int64_t kRepeatModelSimUs = 2'000'000;
// What was lost is asked for by saying again what it answers.
inline constexpr auto kRepeatUnheard = std::chrono::seconds(2);

}  // namespace evalbus::sim
