// Failures of the operating system with files, as errors that users can meet (base/errors.h).
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Throws the error of a failed call, "WHAT: No space left on device": an InputError if the file name is the
// cause (missing, already exists, too long, not permitted), else an EnvironmentError.
[[noreturn]] void ThrowFileError(const std::string& what, int error);

// Calls f and converts exceptions of std::filesystem into these errors: their texts name C++ functions, which
// do not help a user.
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
