// Reads arbitrary bytes as the YAML that maps columns, or a live source, to a task.
#include "base/errors.h"
#include "runner/trajectory_score.h"
#include "sim/source_map.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(trajectory_map) {
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
