// The terminal as a canvas: alternate screen, no cursor, keys without Enter; put back as it was however the
// program ends. Writes never block: a frame that the terminal does not take is dropped.
#pragma once

#include <termios.h>

#include <cstdio>
#include <utility>
#include <vector>

#include "viz/terminal/line.h"

namespace evalbus::viz {

// Columns and rows of the terminal that fd is; 80 and 24 where it does not say.
std::pair<int, int> TerminalSize(int fd);

// Columns of the terminal that a stream goes to; without limit where it is none.
int TerminalWidth(std::FILE* out);

class Terminal {
 public:
  // fd: a terminal. At most one at a time: signals are handled.
  Terminal(int fd, bool colors);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  // Columns and rows now.
  std::pair<int, int> size() const;
  void Draw(const std::vector<Line>& lines);
  // The next key pressed; 0 if none.
  char ReadKey();

 private:
  bool colors_;
};

}  // namespace evalbus::viz
