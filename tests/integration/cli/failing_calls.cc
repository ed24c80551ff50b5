// For LD_PRELOAD: the N-th call of a function on a file below a folder fails, or kills the process.
//
//   FAILING_CALL=pwrite:7:28   the 7th pwrite() fails with this errno
//   FAILING_CALL=pwrite:7:28+  and so do all later ones
//   FAILING_CALL=rename:2:kill the 2nd rename() kills the process before it renames
//   FAILING_BELOW=/tmp/x       only calls on files whose path begins with this count
//   COUNTED_CALLS=/tmp/calls   a line is appended here when a process ends: "pwrite 74"
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

namespace {

struct Setting {
  char name[32] = "";
  long number = 0;
  int error = 0;
  bool kills = false, stays = false;
  const char* below = "";
};

Setting ReadSetting() {
  Setting setting;
  char action[32] = "";
  const char* const text = getenv("FAILING_CALL");
  if (text == nullptr || sscanf(text, "%31[a-z]:%ld:%31s", setting.name, &setting.number, action) != 3)
    return {};
  setting.kills = strcmp(action, "kill") == 0;
  setting.error = atoi(action);
  setting.stays = strchr(action, '+') != nullptr;
  if (const char* const below = getenv("FAILING_BELOW")) setting.below = below;
  return setting;
}

const Setting g_setting = ReadSetting();
long g_calls = 0;

__attribute__((destructor)) void PublishCalls() {
  const char* const file = getenv("COUNTED_CALLS");
  if (file == nullptr || g_calls == 0) return;
  char line[64];
  const int size = snprintf(line, sizeof line, "%s %ld\n", g_setting.name, g_calls);
  const int fd = static_cast<int>(syscall(SYS_openat, AT_FDCWD, file, O_WRONLY | O_CREAT | O_APPEND, 0644));
  syscall(SYS_write, fd, line, size);
}

// Returns whether this call is the one that fails, and then sets errno.
bool Fails(const char* name, const char* path) {
  if (strcmp(g_setting.name, name) != 0 || strncmp(path, g_setting.below, strlen(g_setting.below)) != 0)
    return false;
  ++g_calls;
  const bool fails =
      g_setting.stays ? g_setting.number > 0 && g_calls >= g_setting.number : g_calls == g_setting.number;
  if (!fails) return false;
  if (g_setting.kills) kill(getpid(), SIGKILL);
  errno = g_setting.error;
  return true;
}

bool Fails(const char* name, int fd) {
  char link[64], path[PATH_MAX] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t size = readlink(link, path, sizeof path - 1);
  return size > 0 && Fails(name, path);
}

template <class Function>
Function Real(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" ssize_t write(int fd, const void* data, size_t size) {
  static const auto real = Real(&write, "write");
  return Fails("write", fd) ? -1 : real(fd, data, size);
}

extern "C" ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  static const auto real = Real(&pwrite, "pwrite");
  return Fails("pwrite", fd) ? -1 : real(fd, data, size, offset);
}

extern "C" int fsync(int fd) {
  static const auto real = Real(&fsync, "fsync");
  return Fails("fsync", fd) ? -1 : real(fd);
}

extern "C" int ftruncate(int fd, off_t size) noexcept {
  static const auto real = Real(&ftruncate, "ftruncate");
  return Fails("ftruncate", fd) ? -1 : real(fd, size);
}

extern "C" int close(int fd) {
  static const auto real = Real(&close, "close");
  // The file is closed even if close() fails, as in Linux.
  const bool fails = Fails("close", fd);
  const int error = errno, result = real(fd);
  if (fails) errno = error;
  return fails ? -1 : result;
}

extern "C" int rename(const char* from, const char* to) noexcept {
  static const auto real = Real(&rename, "rename");
  return Fails("rename", to) ? -1 : real(from, to);
}

extern "C" int link(const char* from, const char* to) noexcept {
  static const auto real = Real(&link, "link");
  return Fails("link", to) ? -1 : real(from, to);
}
