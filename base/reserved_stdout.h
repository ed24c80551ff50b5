// Reserves standard output for machine-readable output.
#pragma once

#include <string_view>

namespace evalbus {

// While this object exists, everything else that this process and its children print on standard output goes
// to standard error, or is discarded if discards_text is true. Not thread-safe.
class ReservedStdout {
 public:
  // Throws EnvironmentError.
  explicit ReservedStdout(bool discards_text = false);
  ~ReservedStdout();
  ReservedStdout(const ReservedStdout&) = delete;
  ReservedStdout& operator=(const ReservedStdout&) = delete;

  // Throws EnvironmentError if not everything was written, for example because the reader has exited.
  void Write(std::string_view bytes);
  // Returns false once the reading end of the pipe has been closed, for example because the reader has
  // exited.
  bool has_reader() const;

 private:
  int fd_;
};

}  // namespace evalbus
