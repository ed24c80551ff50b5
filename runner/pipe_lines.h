// A pipe from which the lines that another process writes are read without waiting.
#pragma once

#include <string>
#include <vector>

namespace evalbus::runner {

class PipeLines {
 public:
  // Throws EnvironmentError.
  PipeLines();
  ~PipeLines();
  PipeLines(const PipeLines&) = delete;
  PipeLines& operator=(const PipeLines&) = delete;

  // File descriptor for the process that writes; must be closed here when that process has been started.
  int writer() const { return writer_; }
  void CloseWriter();

  // Returns the lines completed since the last call.
  std::vector<std::string> Next();

 private:
  int reader_ = -1, writer_ = -1;
  // Beginning of a line whose end has not been read.
  std::string rest_;
};

}  // namespace evalbus::runner
