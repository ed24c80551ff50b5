// Files that a command writes besides its output on the terminal.
#pragma once

#include <filesystem>
#include <initializer_list>

namespace evalbus {

struct OutputFile {
  // For errors: "--json".
  const char* option;
  // Empty: not written.
  std::filesystem::path file;
};

// Throws InputError if two of them are the same file, of which only the second would remain.
void CheckFilesDiffer(std::initializer_list<OutputFile> outputs);

}  // namespace evalbus
