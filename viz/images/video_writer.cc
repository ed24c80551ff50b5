#include "viz/images/video_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/find_program.h"
#include "base/write_whole.h"
#include "bus/host.h"

namespace evalbus::viz {
namespace {

// Poll intervals while waiting for room in ffmpeg's socket (kLook) and for ffmpeg's exit (kShortLook), ms.
constexpr int kLook = 100, kShortLook = 2;
// Frames per second of GIF and WebP. It is low, because these formats hardly compress between frames and
// files would become very large.
constexpr int kLoopRate = 10;

// Uses a single thread, and no metadata with version or date, so that equal frames give equal bytes.
std::vector<std::string> Command(FrameSize size, int frames_per_second, const std::string& ending) {
  std::string command = fmt::format(
      "ffmpeg -nostdin -loglevel error -y -f rawvideo -pixel_format bgr0 -video_size {}x{} -framerate {} -i "
      "pipe:0",
      size.width, size.height, frames_per_second);
  if (ending == ".gif") {
    // A palette of 256 colors is computed for this video. Ordered dithering is used, because it does not
    // change where nothing moves, which keeps the file small.
    command += fmt::format(
        " -vf "
        "fps={},split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=bayer:bayer_scale=5:"
        "diff_mode=rectangle -loop 0 -f gif",
        kLoopRate);
  } else if (ending == ".webp") {
    command +=
        fmt::format(" -vf fps={} -pix_fmt yuv420p -c:v libwebp_anim -quality 60 -loop 0 -f webp", kLoopRate);
  } else {
    // There is at least one fragment per second, so that a truncated video plays up to its last complete
    // fragment.
    // Colors are BT.709 and tagged as BT.709.
    command += fmt::format(
        " -vf scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+bitexact -pix_fmt yuv420p -c:v "
        "libx264 -preset veryfast -crf 20 -g {} -colorspace bt709 -color_primaries bt709 -color_trc bt709 "
        "-color_range tv -movflags frag_keyframe+empty_moov+default_base_moof -f mp4",
        frames_per_second);
  }
  command += " -threads 1 -fflags +bitexact -flags:v +bitexact -map_metadata -1 pipe:1";
  std::istringstream words(command);
  using Word = std::istream_iterator<std::string>;
  return std::vector<std::string>(Word(words), Word());
}

}  // namespace

void CheckVideoEnding(const std::string& ending) {
  if (ending == ".mp4" || ending == ".gif" || ending == ".webp") return;
  throw InputError("a video's name must end in .mp4, .gif or .webp, not in '" + ending + "'");
}

VideoWriter::VideoWriter(const std::filesystem::path& file, FrameSize size, int frames_per_second,
                         std::chrono::milliseconds timeout)
    : file_(file), size_(size), timeout_(timeout) {
  const std::string ending = file.extension().string();
  CheckVideoEnding(ending);
  if (size.width % 2 != 0 || size.height % 2 != 0) {
    throw InputError(
        fmt::format("video of {}x{}: expected an even width and height", size.width, size.height));
  }
  const std::vector<std::string> command = Command(size, frames_per_second, ending);
  // A socket is used instead of a pipe, because writing to a socket fails with an error, not with a signal,
  // if ffmpeg has exited. Output and error messages are written to memory files, which cannot block ffmpeg as
  // a full pipe would.
  int sockets[2];
  video_ = memfd_create("video", MFD_CLOEXEC);
  complaints_ = memfd_create("ffmpeg", MFD_CLOEXEC);
  if (video_ < 0 || complaints_ < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) {
    const int error = errno;
    CloseFiles();
    throw EnvironmentError(std::string("cannot communicate with ffmpeg: ") + std::strerror(error));
  }
  frames_ = sockets[0];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, sockets[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, video_, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, complaints_, STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);  // e.g. liblcm's socket
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const std::string program = FindFfmpeg().string();
  // Removes LD_LIBRARY_PATH, because libraries that the user prepends for other programs may be incompatible
  // with ffmpeg.
  std::vector<char*> environment;
  for (char** variable = environ; *variable; ++variable) {
    if (!std::string_view(*variable).starts_with("LD_LIBRARY_PATH=")) environment.push_back(*variable);
  }
  environment.push_back(nullptr);
  const int error = program.empty() ? ENOENT
                                    : posix_spawn(&ffmpeg_, program.c_str(), &actions, nullptr, argv.data(),
                                                  environment.data());
  posix_spawn_file_actions_destroy(&actions);
  close(sockets[1]);
  if (error != 0) {
    ffmpeg_ = -1;
    CloseFiles();
    throw EnvironmentError(
        error == ENOENT ? std::string("videos require the ffmpeg program: install it with ") + kInstallFfmpeg
                        : std::string("cannot start ffmpeg: ") + std::strerror(error));
  }
}

VideoWriter::~VideoWriter() {
  if (ffmpeg_ > 0) {
    kill(ffmpeg_, SIGKILL);
    waitpid(ffmpeg_, nullptr, 0);
  }
  CloseFiles();
}

void VideoWriter::CloseFiles() {
  for (int* fd : {&frames_, &video_, &complaints_}) {
    if (*fd >= 0) close(std::exchange(*fd, -1));
  }
}

void VideoWriter::Write(const Frame& frame) {
  if (frame.size.width != size_.width || frame.size.height != size_.height) {
    throw InputError("video: the size of the frames changed");
  }
  Wait waiting(std::chrono::steady_clock::now());
  for (size_t sent = 0; sent < frame.bgrx.size();) {
    const ssize_t n =
        send(frames_, frame.bgrx.data() + sent, frame.bgrx.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) {
      sent += static_cast<size_t>(n);
      waiting = Wait(std::chrono::steady_clock::now());
    } else if (errno == EAGAIN) {
      CheckTimeout(&waiting);
      pollfd room{frames_, POLLOUT, 0};
      poll(&room, 1, kLook);
    } else if (errno != EINTR) {
      std::string message;
      End(&message);
      Fail(message);
    }
  }
}

void VideoWriter::Close() {
  std::string message;
  if (End(&message) != 0) Fail(message);
  std::string video(static_cast<size_t>(std::max<off_t>(0, lseek(video_, 0, SEEK_END))), '\0');
  if (pread(video_, video.data(), video.size(), 0) != static_cast<ssize_t>(video.size()))
    Fail(std::strerror(errno));
  WriteWhole(file_, video);
}

void VideoWriter::CheckTimeout(Wait* waiting) const {
  if (stop_requested()) throw EnvironmentError("stopped; the unfinished video is not kept");
  if (waiting->Elapsed(std::chrono::steady_clock::now()) < timeout_) return;
  Fail(fmt::format("it hung: no progress for {:g} s", std::chrono::duration<double>(timeout_).count()));
}

int VideoWriter::End(std::string* message) {
  close(std::exchange(frames_, -1));
  int status = 0;
  Wait waiting(std::chrono::steady_clock::now());
  while (waitpid(ffmpeg_, &status, WNOHANG) == 0) {
    CheckTimeout(&waiting);
    poll(nullptr, 0, kShortLook);
  }
  ffmpeg_ = -1;
  // Only the first line is used, because it names the cause and the other lines are consequences.
  char text[512];
  const ssize_t n = pread(complaints_, text, sizeof text, 0);
  *message = std::string(text, static_cast<size_t>(std::max<ssize_t>(n, 0)));
  *message = message->substr(0, message->find('\n'));
  if (WIFSIGNALED(status)) *message = std::string("ended by signal: ") + strsignal(WTERMSIG(status));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

void VideoWriter::Fail(const std::string& message) const {
  throw EnvironmentError("ffmpeg could not make " + file_.string() + ": " +
                         (message.empty() ? "it ended without an error message" : message));
}

}  // namespace evalbus::viz
