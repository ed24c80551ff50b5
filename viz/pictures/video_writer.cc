#include "viz/pictures/video_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "base/errors.h"
#include "base/run_layout.h"

namespace evalbus::viz {

VideoWriter::VideoWriter(const std::filesystem::path& file, FrameSize size, int frames_per_second)
    : file_(file),
      partial_(file.parent_path() / (file.stem().string() + kUnfinishedFilmEnding)),
      size_(size) {
  if (size.width % 2 != 0 || size.height % 2 != 0) {
    throw InputError(
        fmt::format("film of {}x{}: H.264 needs an even width and height", size.width, size.height));
  }
  // Who writes into the file that an earlier process left, its orphaned ffmpeg, shall not write into ours.
  std::error_code none_there;
  std::filesystem::remove(partial_, none_there);
  // One thread and no versions or dates inside: equal frames, equal bytes. A fragment a second: a film that
  // is cut plays up to the last whole one. Colours are BT.709, and say so.
  const std::vector<std::string> command = {
      "ffmpeg",
      "-nostdin",
      "-loglevel",
      "error",
      "-y",
      "-f",
      "rawvideo",
      "-pixel_format",
      "bgr0",
      "-video_size",
      fmt::format("{}x{}", size.width, size.height),
      "-framerate",
      std::to_string(frames_per_second),
      "-i",
      "pipe:0",
      "-vf",
      "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+bitexact",
      "-pix_fmt",
      "yuv420p",
      "-c:v",
      "libx264",
      "-preset",
      "veryfast",
      "-crf",
      "20",
      "-threads",
      "1",
      "-g",
      std::to_string(frames_per_second),
      "-colorspace",
      "bt709",
      "-color_primaries",
      "bt709",
      "-color_trc",
      "bt709",
      "-color_range",
      "tv",
      "-fflags",
      "+bitexact",
      "-flags:v",
      "+bitexact",
      "-map_metadata",
      "-1",
      "-movflags",
      "frag_keyframe+empty_moov+default_base_moof",
      "-f",
      "mp4",
      "file:" + partial_.string()};
  // A socket, not a pipe: writing to an ffmpeg that has gone is then an error and not a signal. Its
  // complaints go to memory, which never fills up like a pipe that nobody reads.
  int sockets[2];
  complaints_ = memfd_create("ffmpeg", MFD_CLOEXEC);
  if (complaints_ < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) {
    throw EnvironmentError(std::string("cannot talk to ffmpeg: ") + std::strerror(errno));
  }
  frames_ = sockets[0];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, sockets[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, complaints_, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, complaints_, STDERR_FILENO);
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int error = posix_spawnp(&ffmpeg_, "ffmpeg", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(sockets[1]);
  if (error != 0) {
    ffmpeg_ = -1;
    close(frames_);
    close(complaints_);
    throw EnvironmentError(error == ENOENT
                               ? "films need the ffmpeg program: install it with 'apt-get install ffmpeg'"
                               : std::string("cannot start ffmpeg: ") + std::strerror(error));
  }
}

VideoWriter::~VideoWriter() {
  if (ffmpeg_ > 0) {
    kill(ffmpeg_, SIGKILL);
    std::string ignored;
    Wait(&ignored);
    std::error_code error;
    std::filesystem::remove(partial_, error);
  }
}

void VideoWriter::Write(const Frame& frame) {
  if (frame.size.width != size_.width || frame.size.height != size_.height) {
    throw InputError("film: a frame of another size");
  }
  for (size_t sent = 0; sent < frame.bgrx.size();) {
    const ssize_t n = send(frames_, frame.bgrx.data() + sent, frame.bgrx.size() - sent, MSG_NOSIGNAL);
    if (n > 0) {
      sent += static_cast<size_t>(n);
    } else if (errno != EINTR) {
      std::string message;
      Wait(&message);
      Fail(message);
    }
  }
}

void VideoWriter::Close() {
  std::string message;
  if (Wait(&message) != 0) Fail(message);
  std::error_code error;
  std::filesystem::rename(partial_, file_, error);
  if (error) throw EnvironmentError("cannot write " + file_.string() + ": " + error.message());
}

int VideoWriter::Wait(std::string* message) {
  close(frames_);
  int status = 0;
  while (waitpid(ffmpeg_, &status, 0) < 0 && errno == EINTR) {
  }
  ffmpeg_ = -1;
  // Its first line names the trouble; the others follow from it.
  char text[512];
  const ssize_t n = pread(complaints_, text, sizeof text, 0);
  close(complaints_);
  *message = std::string(text, static_cast<size_t>(std::max<ssize_t>(n, 0)));
  *message = message->substr(0, message->find('\n'));
  if (WIFSIGNALED(status)) *message = std::string("ended by signal: ") + strsignal(WTERMSIG(status));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

void VideoWriter::Fail(const std::string& message) {
  std::error_code ignored;
  std::filesystem::remove(partial_, ignored);
  throw EnvironmentError("ffmpeg could not make " + file_.string() + ": " +
                         (message.empty() ? "it stopped without a word" : message));
}

}  // namespace evalbus::viz
