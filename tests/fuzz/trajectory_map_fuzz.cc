// Any bytes as the YAML that maps columns, or a live source, to a task.
#include "base/errors.h"
#include "runner/trajectory_score.h"
#include "sim/source_map.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    evalbus::runner::ReadTrajectoryMap(text, "x.yaml");
  } catch (const evalbus::InputError&) {
  }
  try {
    evalbus::sim::ReadSourceMap(text, "x.yaml");
  } catch (const evalbus::InputError&) {
  }
  return 0;
}
