#include "base/output_files.h"

#include <fmt/format.h>

#include <map>

#include "base/errors.h"

namespace evalbus {

void CheckFilesDiffer(std::initializer_list<OutputFile> outputs) {
  std::map<std::filesystem::path, const char*> options;
  for (const OutputFile& output : outputs) {
    if (output.file.empty()) continue;
    const auto [other, is_new] = options.emplace(
        std::filesystem::weakly_canonical(std::filesystem::absolute(output.file)), output.option);
    if (!is_new)
      throw InputError(fmt::format("{} and {} name the same file: {}", other->second, output.option,
                                   output.file.string()));
  }
}

}  // namespace evalbus
