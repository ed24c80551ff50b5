// Failures of the operating system with files, as errors that users can meet (base/errors.h).
#pragma once

#include <filesystem>
#include <string>

namespace evalbus {

// Throws what a call failed of, "WHAT: No space left on device": an InputError where the name of a file is
// wrong (not there, in the way, too long, not permitted), else an EnvironmentError.
[[noreturn]] void ThrowFileError(const std::string& what, int error);

// Does it, with the library's exceptions made such errors: its own words name a function of C++, not who is
// to do what.
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
