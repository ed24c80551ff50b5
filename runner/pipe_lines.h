// A pipe for reading the lines that another process writes, without waiting.
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

  // Returns the file descriptor for the writing process. Must be closed in this process after the other
  // process was started.
  int writer() const { return writer_; }
  void CloseWriter();

  // Returns the lines completed since the last call.
  std::vector<std::string> Next();

 private:
  int reader_ = -1, writer_ = -1;
  // Beginning of a line whose end has not arrived yet.
  std::string rest_;
};

}  // namespace evalbus::runner
