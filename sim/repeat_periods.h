// Periods after which a sim, or the component in its place, repeats messages that others may have missed.
#pragma once

#include <chrono>
#include <cstdint>

namespace evalbus::sim {

// EPISODE_BEGIN is repeated until all components are ready.
inline constexpr auto kAnnouncePeriod = std::chrono::milliseconds(200);
// MODEL is repeated during an episode for observers that start later: after the wall-clock period, which
// matters for slow policies, or after the simulated period. The latter ensures that the log of a run faster
// than real time also repeats MODEL.
inline constexpr auto kRepeatModel = std::chrono::seconds(1);
inline constexpr int64_t kRepeatModelSimUs = 2'000'000;
// A message whose answer does not arrive is repeated, in case either was lost.
inline constexpr auto kRepeatUnanswered = std::chrono::seconds(2);

}  // namespace evalbus::sim
