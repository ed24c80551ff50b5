// Any text as a run folder: the first line is run.json, the others are episodes.jsonl.
#include <algorithm>

#include "bus/errors.h"
#include "cli/run_reader.h"
#include "tests/fuzz/scratch_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const evalbus::ScratchFolder folder;
  const uint8_t* end = std::find(data, data + size, '\n');
  folder.Write("run.json", data, static_cast<size_t>(end - data));
  if (end != data + size) ++end;
  folder.Write("episodes.jsonl", end, static_cast<size_t>(data + size - end));
  try {
    for (const auto& episode : evalbus::ReadRun(folder.path()).episodes) episode.Values();
  } catch (const evalbus::InputError&) {
  }
  return 0;
}
