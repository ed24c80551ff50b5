#include "cli/run_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "bus/errors.h"
#include "bus/recorder.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// Writes and syncs; the flags say whether the file is replaced or extended.
void WriteSynced(const fs::path& file, const std::string& text, int flags) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0644);
  bool good = fd >= 0;
  for (size_t done = 0; good && done < text.size();) {
    const ssize_t n = write(fd, text.data() + done, text.size() - done);
    good = n >= 0 || errno == EINTR;
    if (n > 0) done += static_cast<size_t>(n);
  }
  good = good && fsync(fd) == 0;
  const int error = errno;
  if (fd >= 0) close(fd);
  if (!good) throw EnvironmentError("cannot write " + file.string() + ": " + std::strerror(error));
}

}  // namespace

RunFolder::RunFolder(const fs::path& folder) : path_(fs::absolute(folder).lexically_normal()) {
  std::error_code error;
  if (fs::exists(path_) && !(fs::is_directory(path_) && fs::is_empty(path_, error))) {
    throw InputError("--out " + folder.string() + ": exists and is not an empty folder; choose another name");
  }
  fs::create_directories(path_ / "logs", error);
  if (!error) fs::create_directories(path_ / "episodes", error);
  if (error) throw InputError("--out " + folder.string() + ": cannot create: " + error.message());
}

void RunFolder::WriteJson(const std::string& name, const nlohmann::ordered_json& json) const {
  const fs::path file = path_ / name;
  const fs::path temporary = file.string() + ".tmp";
  WriteSynced(temporary, json.dump(2) + "\n", O_TRUNC);
  fs::rename(temporary, file);
}

void RunFolder::AddEpisode(int episode, const nlohmann::ordered_json& result) const {
  const fs::path folder = fs::relative(EpisodeFolder(path_, episode), path_);
  fs::create_directories(path_ / folder);
  WriteJson((folder / "summary.json").string(), result);
  WriteSynced(path_ / "episodes.jsonl", result.dump() + "\n", O_APPEND);
}

void RunFolder::DiscardEpisode(int episode) const {
  fs::remove_all(EpisodeFolder(path_, episode));
  fs::remove_all(EpisodeFolder(path_, episode).string() + ".partial");
}

fs::path DefaultRunFolder(const std::string& name) {
  char stamp[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", std::localtime(&now));
  const fs::path wish = fs::path("runs") / (name + "-" + stamp);
  fs::path free = wish;
  // Two runs in one second.
  for (int i = 2; fs::exists(free); ++i) free = wish.string() + "-" + std::to_string(i);
  return free;
}

}  // namespace evalbus
