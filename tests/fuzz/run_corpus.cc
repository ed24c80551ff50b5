// fuzz_corpus TARGET [-changed=N] FOLDER...: runs a fuzz target without libFuzzer on every file of the
// folders and then on N mutations. The mutations are the same at every call. A large N allows longer fuzzing
// without clang.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/mutate.h"

namespace evalbus {
namespace {

std::map<std::string, FuzzTarget>& Targets() {
  static std::map<std::string, FuzzTarget> targets;
  return targets;
}

}  // namespace

bool AddFuzzTarget(const char* name, FuzzTarget target) { return Targets().emplace(name, target).second; }

}  // namespace evalbus

int main(int argc, char** argv) {
  const auto found = argc > 1 ? evalbus::Targets().find(argv[1]) : evalbus::Targets().end();
  if (found == evalbus::Targets().end()) {
    std::fprintf(stderr, "usage: fuzz_corpus TARGET [-changed=N] FOLDER..., with a target of tests/fuzz\n");
    return 1;
  }
  const auto run = [&](const std::string& input) {
    found->second(reinterpret_cast<const uint8_t*>(input.data()), input.size());
  };
  unsigned num_changed = 0;
  std::vector<std::filesystem::path> files;
  for (int i = 2; i < argc; ++i) {
    if (std::sscanf(argv[i], "-changed=%u", &num_changed) == 1) continue;
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> inputs;
  for (const auto& file : files) {
    std::ifstream stream(file, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    run(inputs.back());
  }
  for (unsigned i = 0; i < num_changed && !inputs.empty(); ++i) {
    std::string input = inputs[i % inputs.size()];
    for (unsigned change = 0; change <= i % 4; ++change) input = evalbus::Mutate(input, 4 * i + change);
    run(input);
  }
  std::printf("%zu inputs and %u changed ones\n", inputs.size(), num_changed);
  return inputs.empty() ? 1 : 0;
}
