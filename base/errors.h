// The two kinds of failure that a user can encounter. Any other exception is a bug, of evalbus or of a
// plugin.
#pragma once

#include <iostream>
#include <stdexcept>
#include <string>

#include "base/text.h"

namespace evalbus {

// The user's input is wrong: a file, a key, an option, a name. what() is one line that states what is wrong,
// where, and what to do. Programs exit with code 1.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The machine, the bus or a component failed. what() is one line. Programs exit with code 2.
struct EnvironmentError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A failure that a restart of the component would not repair. The launcher ends the run without another
// attempt. Programs exit with code 2, components of a run with kLastingFailureCode.
struct LastingError : EnvironmentError {
  using EnvironmentError::EnvironmentError;
};
inline constexpr int kLastingFailureCode = 3;

// Text for an exception that is not a std::exception. Only plugins throw such exceptions.
inline constexpr char kNotAnException[] = "an exception that is not a std::exception, possibly from a plugin";

// Prints the error that ends the program on stderr. Returns the exit code.
inline int ReportError(const std::exception& error) {
  std::cerr << "error: " << Printable(error.what()) << std::endl;
  return dynamic_cast<const InputError*>(&error) ? 1 : 2;
}

}  // namespace evalbus
