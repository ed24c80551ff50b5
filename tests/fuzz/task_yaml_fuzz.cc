// Any text as a task description.
#include <string>

#include "bus/errors.h"
#include "models/task_description.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  try {
    evalbus::ParseTask(std::string(data, data + size), "fuzz.yaml", false);
  } catch (const evalbus::InputError&) {
  }
  return 0;
}
