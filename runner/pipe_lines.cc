#include "runner/pipe_lines.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "base/file_errors.h"

namespace evalbus::runner {

PipeLines::PipeLines() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) ThrowFileError("pipe", errno);
  reader_ = ends[0];
  writer_ = ends[1];
  fcntl(reader_, F_SETFL, O_NONBLOCK);
}

PipeLines::~PipeLines() {
  CloseWriter();
  close(reader_);
}

void PipeLines::CloseWriter() {
  if (writer_ >= 0) close(writer_);
  writer_ = -1;
}

std::vector<std::string> PipeLines::Next() {
  char buffer[1 << 16];
  for (ssize_t size; (size = read(reader_, buffer, sizeof buffer)) > 0;)
    rest_.append(buffer, static_cast<size_t>(size));
  std::vector<std::string> lines;
  size_t begin = 0;
  for (size_t end; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1) {
    lines.push_back(rest_.substr(begin, end - begin));
  }
  rest_.erase(0, begin);
  return lines;
}

}  // namespace evalbus::runner
