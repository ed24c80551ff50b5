// main() of a fuzz target without libFuzzer: runs every file of the given folders, then -changed=N mutations,
// the same at every call. With a large N it also serves for longer fuzzing without clang.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/mutate.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

void Run(const std::string& input) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(input.data()), input.size());
}

}  // namespace

int main(int argc, char** argv) {
  unsigned num_changed = 0;
  std::vector<std::filesystem::path> files;
  for (int i = 1; i < argc; ++i) {
    if (argv[i][0] == '-') {  // other options are libFuzzer's
      std::sscanf(argv[i], "-changed=%u", &num_changed);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> inputs;
  for (const auto& file : files) {
    std::ifstream stream(file, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    Run(inputs.back());
  }
  for (unsigned i = 0; i < num_changed && !inputs.empty(); ++i) {
    std::string input = inputs[i % inputs.size()];
    for (unsigned change = 0; change <= i % 4; ++change) input = evalbus::Mutate(input, 4 * i + change);
    Run(input);
  }
  std::printf("%zu inputs and %u changed ones\n", inputs.size(), num_changed);
  return inputs.empty() ? 1 : 0;
}
