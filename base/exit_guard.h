// Guards a program against exit() calls of its plugins.
#pragma once

namespace evalbus {

// While an object of this class lives in main(), exit() is reported as an error and ends the program with
// code 2: a plugin that calls it would otherwise end a run half-way with an exit code of its own choice.
class ExitGuard {
 public:
  ExitGuard();
  ~ExitGuard();
  ExitGuard(const ExitGuard&) = delete;
  ExitGuard& operator=(const ExitGuard&) = delete;
};

}  // namespace evalbus
