// Guards a program against exit() calls of its plugins.
#pragma once

namespace evalbus {

// While an object of this class exists in main(), a call of exit() is reported as an error and ends the
// program with code 2. Otherwise, a plugin that calls exit() would end a run in the middle with an arbitrary
// exit code.
class ExitGuard {
 public:
  ExitGuard();
  ~ExitGuard();
  ExitGuard(const ExitGuard&) = delete;
  ExitGuard& operator=(const ExitGuard&) = delete;
};

}  // namespace evalbus
