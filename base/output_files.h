// Files that a command writes in addition to its output on the terminal.
#pragma once

#include <filesystem>
#include <initializer_list>

namespace evalbus {

struct OutputFile {
  // Name of the option ("--json"), for errors.
  const char* option;
  // File to write; empty if the option is not given.
  std::filesystem::path file;
};

// Throws InputError if two outputs have the same file, because the second would replace the first.
void CheckFilesDiffer(std::initializer_list<OutputFile> outputs);

}  // namespace evalbus
