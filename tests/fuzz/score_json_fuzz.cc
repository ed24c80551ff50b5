// Any text as the file of a recorded trajectory.
#include "base/errors.h"
#include "metrics/episode/score_file.h"
#include "tests/fuzz/scratch_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace evalbus;
  static const ScratchFolder folder;
  try {
    metrics::ScoreFile(folder.Write("trajectory.json", data, size)).dump();
  } catch (const InputError&) {
  }
  return 0;
}
