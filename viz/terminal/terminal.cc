#include "viz/terminal/terminal.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <limits>

#include "base/styled_text.h"

namespace evalbus::viz {
namespace {

constexpr char kEnter[] = "\x1b[?1049h\x1b[?25l\x1b[2J";
constexpr char kLeave[] = "\x1b[0m\x1b[?25h\x1b[?1049l";
// Signals that end a program without cleanup. SIGINT and SIGTERM are handled by the program's main loop.
constexpr int kFatal[] = {SIGHUP, SIGQUIT, SIGILL, SIGABRT, SIGBUS, SIGFPE, SIGSEGV};

// State of the terminal. The functions below run in signal handlers, so they call only async-signal-safe
// functions.
int g_fd = -1;
termios g_before{};

void Write(const char* text, size_t size) {
  if (write(g_fd, text, size) < 0) {
    // An error is ignored. If the terminal no longer exists, no recovery is possible.
  }
}

void Enter() {
  termios raw = g_before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // ISIG stays set: Ctrl-C and Ctrl-Z raise signals
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  tcsetattr(g_fd, TCSANOW, &raw);
  Write(kEnter, sizeof kEnter - 1);
}

void Leave() {
  Write(kLeave, sizeof kLeave - 1);
  tcsetattr(g_fd, TCSANOW, &g_before);
}

void Handle(int signal, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigaction(signal, &action, nullptr);
}

void OnFatal(int signal) {
  Leave();
  raise(signal);  // SA_RESETHAND restored the default action, which ends the program
}

void OnSuspend(int signal) {
  const int error = errno;
  Leave();
  sigset_t mask;
  sigemptyset(&mask);
  sigaddset(&mask, signal);
  Handle(signal, SIG_DFL, 0);
  raise(signal);
  sigprocmask(SIG_UNBLOCK, &mask, nullptr);  // the process stops here until SIGCONT
  Handle(signal, OnSuspend, 0);
  Enter();
  errno = error;
}

}  // namespace

std::pair<int, int> TerminalSize(int fd) {
  winsize size{};
  if (ioctl(fd, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {80, 24};
  return {size.ws_col, size.ws_row};
}

int TerminalWidth(std::FILE* out) {
  const int fd = fileno(out);
  return isatty(fd) != 0 ? TerminalSize(fd).first : std::numeric_limits<int>::max();
}

Terminal::Terminal(int fd, bool colors) : colors_(colors) {
  // The terminal is opened again, because setting O_NONBLOCK on `fd` would affect the shell, which shares its
  // file description.
  const char* name = ttyname(fd);
  g_fd = name == nullptr ? -1 : open(name, O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (g_fd < 0) g_fd = dup(fd);
  tcgetattr(g_fd, &g_before);
  for (const int signal : kFatal) Handle(signal, OnFatal, static_cast<int>(SA_RESETHAND));
  Handle(SIGTSTP, OnSuspend, 0);
  Enter();
}

Terminal::~Terminal() {
  Leave();
  for (const int signal : kFatal) Handle(signal, SIG_DFL, 0);
  Handle(SIGTSTP, SIG_DFL, 0);
  close(g_fd);
}

std::pair<int, int> Terminal::size() const { return TerminalSize(g_fd); }

void Terminal::Draw(const std::vector<Line>& lines) {
  const auto [columns, rows] = size();
  // Overwrites the previous frame, which avoids flicker. Nothing is cleared after a full line or a full
  // screen, because the cursor is then still on the last character.
  std::string frame = "\x1b[H";
  for (size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) frame += "\r\n";
    for (const Span& span : lines[i]) frame += Styled(span.text, span.style, colors_);
    if (LineWidth(lines[i]) < columns) frame += "\x1b[K";
  }
  if (static_cast<int>(lines.size()) < rows) frame += "\r\n\x1b[J";
  Write(frame.data(), frame.size());
}

char Terminal::ReadKey() {
  char key = 0;
  return read(g_fd, &key, 1) == 1 ? key : '\0';
}

}  // namespace evalbus::viz
