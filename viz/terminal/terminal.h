// Full-screen terminal output with alternate screen, hidden cursor and key input without Enter. The terminal
// is restored when the program ends or is suspended, even by a signal (except SIGKILL and SIGSTOP). Writes do
// not block if the terminal can be opened again: what the terminal cannot accept of a frame is dropped.
#pragma once

#include <termios.h>

#include <cstdio>
#include <utility>
#include <vector>

#include "viz/terminal/line.h"

namespace evalbus::viz {

// Returns the number of columns and rows of the terminal fd, or 80 and 24 if they are unknown.
std::pair<int, int> TerminalSize(int fd);

// Returns the number of columns of the terminal to which a stream writes. It is unlimited if the stream is
// not a terminal.
int TerminalWidth(std::FILE* out);

class Terminal {
 public:
  // fd: must be a terminal. Only one instance may exist at a time, because it installs signal handlers.
  Terminal(int fd, bool colors);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  // Returns the current number of columns and rows.
  std::pair<int, int> size() const;
  void Draw(const std::vector<Line>& lines);
  // Returns the next pressed key, or 0 if there is none.
  char ReadKey();

 private:
  bool colors_;
};

}  // namespace evalbus::viz
