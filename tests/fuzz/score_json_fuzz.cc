// Any text as a recorded trajectory.
#include "bus/errors.h"
#include "metrics/score_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto json = nlohmann::json::parse(data, data + size, nullptr, false);
  if (json.is_discarded()) return 0;
  try {
    evalbus::ScoreEpisode(json, "fuzz.json");
  } catch (const evalbus::InputError&) {
  }
  return 0;
}
