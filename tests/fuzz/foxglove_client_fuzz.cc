// Parses arbitrary bytes as messages of a Foxglove client, text and binary.
#include <cmath>
#include <cstdlib>

#include "export/foxglove_protocol.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(foxglove_client) {
  using namespace evalbus::exports;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  ChooseSubprotocol(bytes);
  ParseClientText(bytes);
  if (const auto control = ParsePlaybackControl(bytes)) {
    constexpr int64_t kEnd = 5'000'000'000;
    Playback playback(kEnd);
    const PlaybackState state = playback.Control(*control, {});
    const PlaybackState later = playback.State(Playback::Time() + std::chrono::hours(1));
    if (state.time_ns < 0 || later.time_ns < state.time_ns || later.time_ns > kEnd) std::abort();
    if (!(state.speed > 0) || !std::isfinite(state.speed)) std::abort();
  }
  return 0;
}
