// Converts failures of file operations to errors for users (base/errors.h).
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Throws an error for a failed call, "WHAT: No space left on device". It is an InputError if the file name is
// the cause (missing, already exists, too long, not permitted), otherwise an EnvironmentError.
[[noreturn]] void ThrowFileError(const std::string& what, int error);

// Calls f and converts exceptions of std::filesystem to these errors, because the texts of such exceptions
// name C++ functions, which do not help users.
template <class F>
auto WithClearFileErrors(const F& f) {
  try {
    return f();
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string path = error.path1().string();
    ThrowFileError(path.empty() ? "the current folder" : path, error.code().value());
  }
}

}  // namespace evalbus
