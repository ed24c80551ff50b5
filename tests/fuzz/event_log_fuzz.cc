// Any bytes as an event log: read, and scored.
#include <cstdlib>

#include "bus/errors.h"
#include "bus/event_log.h"
#include "cli/rescore.h"
#include "tests/fuzz/scratch_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace evalbus;
  static const ScratchFolder folder;
  const auto file = folder.Write("events.lcmlog", data, size);
  EventLogReader reader(file);
  size_t bytes = 0;
  for (LogEvent event; reader.Next(&event);) bytes += 28 + event.channel.size() + event.data.size();
  // Every byte is part of an event or said to be damaged.
  if (bytes + static_cast<size_t>(reader.damaged_bytes()) != size) std::abort();
  try {
    Rescorer().Rescore(file);
  } catch (const InputError&) {
  }
  return 0;
}
