// Any text as a robot description.
#include "bus/errors.h"
#include "models/robot_description.h"
#include "tests/fuzz/scratch_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const evalbus::ScratchFolder folder;
  try {
    evalbus::LoadRobot(folder.Write("robot.yaml", data, size), {EVALBUS_SOURCE_DIR "/models/robots"});
  } catch (const evalbus::InputError&) {
  }
  return 0;
}
