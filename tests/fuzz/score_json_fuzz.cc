// Any text as the file of a recorded trajectory.
#include "bus/errors.h"
#include "metrics/json_file.h"
#include "metrics/score_file.h"
#include "tests/fuzz/scratch_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace evalbus;
  static const ScratchFolder folder;
  try {
    ScoreEpisode(ReadJsonFile(folder.Write("trajectory.json", data, size)), "trajectory.json").dump();
  } catch (const InputError&) {
  }
  return 0;
}
