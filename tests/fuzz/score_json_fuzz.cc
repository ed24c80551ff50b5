// Reads any text as the file of a recorded trajectory. Reading it step by step and parsing it as a whole must
// give bit-identical results, or both must fail.
#include <cstdlib>
#include <string>

#include "base/errors.h"
#include "metrics/episode/score_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace {

std::string ResultOf(auto score) {
  try {
    return score().dump();
  } catch (const evalbus::InputError&) {
    return "";
  }
}

}  // namespace

FUZZ_TARGET(score_json) {
  using namespace evalbus;
  static const ScratchFolder folder;
  const std::filesystem::path file = folder.Write("trajectory.json", data, size);
  const std::string result = ResultOf([&] { return metrics::ScoreFile(file); });
  if (result != ResultOf([&] { return metrics::ScoreEpisode(ReadJsonFile(file), file); })) std::abort();
  return 0;
}
