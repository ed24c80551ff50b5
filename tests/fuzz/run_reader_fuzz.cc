// Reads arbitrary text as a run folder: the first line is run.json, and the others are episodes.jsonl. The
// folder is read both as report, compare and export read it, and as --resume reads it.
#include <algorithm>

#include "base/errors.h"
#include "results/comparison.h"
#include "results/comparison_json.h"
#include "results/comparison_text.h"
#include "results/run_folder.h"
#include "results/run_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace {

template <class Read>
void ReadOrRefuse(const Read& read) {
  try {
    read();
  } catch (const evalbus::InputError&) {
  }
}

}  // namespace

FUZZ_TARGET(run_reader) {
  using namespace evalbus;
  static const ScratchFolder folder;
  const uint8_t* end = std::find(data, data + size, '\n');
  folder.Write("run.json", data, static_cast<size_t>(end - data));
  if (end != data + size) ++end;
  folder.Write("episodes.jsonl", end, static_cast<size_t>(data + size - end));
  ReadOrRefuse([] {
    const results::RecordedRuns runs = results::ReadRuns(folder.path());
    runs.runs[0].Remarks();
    for (const results::RecordedEpisode& episode : runs.runs[0].episodes) episode.Values();
    // Compares the runs with copies of themselves whose seeds are in a different order.
    results::RecordedRuns baseline = runs;
    std::swap(baseline.runs[0].episodes.front().seed, baseline.runs[0].episodes.back().seed);
    const results::Comparison comparison = results::CompareRuns(runs, baseline);
    results::ComparisonText(comparison, true);
    results::ComparisonJson({comparison}).dump();
  });
  ReadOrRefuse([] { results::ReadRunAsFarAsItGot(folder.path()); });
  return 0;
}
