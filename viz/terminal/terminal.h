// The terminal as a canvas: alternate screen, no cursor, keys without Enter; put back as it was however the
// program ends. Writes never block: a frame that the terminal does not take is dropped.
#pragma once

#include <termios.h>

#include <string>
#include <vector>

#include "viz/terminal/monitor_model.h"

namespace evalbus::viz {

class Terminal {
 public:
  // fd: a terminal. At most one at a time: signals are handled.
  Terminal(int fd, bool colours);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  // Columns and rows now.
  std::pair<int, int> size() const;
  void Draw(const std::vector<Line>& lines);
  // The next key pressed; 0 if none.
  char ReadKey();

 private:
  bool colours_;
};

}  // namespace evalbus::viz
