// Any bytes as the YAML that maps columns to a task.
#include "base/errors.h"
#include "runner/trajectory_score.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    evalbus::runner::ReadTrajectoryMap({reinterpret_cast<const char*>(data), size}, "x.yaml");
  } catch (const evalbus::InputError&) {
  }
  return 0;
}
