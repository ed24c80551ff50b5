// Reads arbitrary bytes as an npz file. The content of every member must be within the file.
#include <cstdlib>

#include "base/errors.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"
#include "runner/trajectory_table.h"
#include "tests/fuzz/fuzz_target.h"

FUZZ_TARGET(npz) {
  using namespace evalbus;
  try {
    for (const runner::ZipEntry& entry : runner::ZipEntries({data, size}, "x")) {
      if (entry.bytes.data() < data || entry.bytes.data() + entry.bytes.size() > data + size) std::abort();
      try {
        policy::DecodeNpy(entry.bytes);
      } catch (const policy::ServerError&) {
      }
    }
  } catch (const InputError&) {
  }
  return 0;
}
