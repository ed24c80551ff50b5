#include "cli/results/run_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>
#include <set>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "bus/recorder/recorder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;

// A killed run's processes hold its lock until the last of them is gone, moments after it.
constexpr auto kLockWait = std::chrono::milliseconds(500);

// An open file to write to; its failures throw EnvironmentError.
class File {
 public:
  File(fs::path file, int flags)
      : file_(std::move(file)), fd_(open(file_.c_str(), O_CREAT | O_CLOEXEC | flags, 0644)) {
    Check(fd_ >= 0);
  }
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void WriteSynced(const std::string& text) {
    for (size_t done = 0; done < text.size();) {
      const ssize_t n = write(fd_, text.data() + done, text.size() - done);
      Check(n >= 0 || errno == EINTR);
      if (n > 0) done += static_cast<size_t>(n);
    }
    Check(fsync(fd_) == 0);
  }
  // Until this object goes, or its process dies.
  void Lock() { Check(flock(fd_, LOCK_EX) == 0); }
  // Removes what is behind the last end of a line.
  void CutUnfinishedLine() {
    off_t end = lseek(fd_, 0, SEEK_END);
    const off_t size = end;
    for (char last = 0; end > 0; --end) {
      Check(pread(fd_, &last, 1, end - 1) == 1);
      if (last == '\n') break;
    }
    if (end < size) Check(ftruncate(fd_, end) == 0);
  }

 private:
  void Check(bool good) const {
    if (!good) throw EnvironmentError("cannot write " + file_.string() + ": " + std::strerror(errno));
  }

  fs::path file_;
  int fd_;
};

// True if a run that was to be here has not got as far as its mark.
bool HoldsNothing(const fs::path& folder, const std::string& mark) {
  return std::ranges::all_of(fs::directory_iterator(folder), [&](const fs::directory_entry& entry) {
    return (entry.path().filename() == kLogsFolder && entry.is_directory() && fs::is_empty(entry)) ||
           (entry.path().filename().string().starts_with(mark) &&
            entry.path().filename().string().ends_with(kTemporaryEnding));
  });
}

}  // namespace

RunFolder::RunFolder(const fs::path& folder, bool resume, const std::string& mark)
    : path_(fs::absolute(folder).lexically_normal()) {
  std::error_code error;
  const bool fresh =
      !fs::exists(path_) ||
      (fs::is_directory(path_) && (resume ? HoldsNothing(path_, mark) : fs::is_empty(path_, error)));
  if (!fresh && !(resume && fs::exists(path_ / mark))) {
    throw InputError("--out " + folder.string() +
                     (resume
                          ? ": exists and holds nothing to resume; it has no " + mark
                          : ": exists and is not an empty folder; choose another name, or add --resume to go "
                            "on with what was interrupted"));
  }
  fs::create_directories(path_ / kLogsFolder, error);
  if (error) throw InputError("--out " + folder.string() + ": cannot create: " + error.message());
  lock_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY);
  const auto deadline = std::chrono::steady_clock::now() + kLockWait;
  while (lock_ >= 0 && flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      close(std::exchange(lock_, -1));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  if (lock_ < 0) {
    throw InputError("--out " + folder.string() + ": another 'evalbus run' is at work in it");
  }
  if (!fresh && mark == kRunJson) Clean();
}

fs::path RunFolder::shown() const {
  const fs::path near = fs::proximate(path_);
  return near.string().starts_with("..") ? path_ : near;
}

RunFolder RunFolder::OfWorker(const fs::path& folder) {
  RunFolder run;
  run.path_ = fs::absolute(folder).lexically_normal();
  return run;
}

RunFolder::~RunFolder() {
  if (lock_ >= 0) close(lock_);
}

void RunFolder::Clean() const {
  std::set<fs::path> finished;
  for (const auto& episode : SortEpisodes()) {  // which leaves out a last line that was cut
    finished.insert(EpisodeFolder(path_, episode["episode"].get<int>()));
  }
  std::error_code none_there;
  for (const auto& entry : fs::directory_iterator(path_ / kEpisodesFolder, none_there)) {
    if (!finished.contains(entry.path())) fs::remove_all(entry.path());
  }
  RemoveFiles(kTemporaryEnding);
  RemoveFiles(kUnfinishedFilmEnding);
}

void RunFolder::RemoveFiles(const std::string& ending) const {
  // A killed worker's processes may be about to follow it: folders can go while we look.
  std::error_code gone;
  for (auto entry = fs::recursive_directory_iterator(path_, gone);
       entry != fs::recursive_directory_iterator(); entry.increment(gone)) {
    if (entry->path().filename().string().ends_with(ending)) fs::remove(entry->path(), gone);
  }
}

std::vector<std::string> NewLines::Next() {
  std::vector<std::string> lines;
  std::ifstream stream(file_);
  stream.seekg(position_);
  std::string line;
  while (std::getline(stream, line) && !stream.eof()) {
    position_ = stream.tellg();
    lines.push_back(line);
  }
  return lines;
}

std::vector<nlohmann::ordered_json> EpisodeLines::Next() {
  std::vector<nlohmann::ordered_json> episodes;
  for (const std::string& text : lines_.Next()) {
    ++line_;
    bool has_number = false;
    try {
      episodes.push_back(nlohmann::ordered_json::parse(text));
      has_number = episodes.back().at("episode").is_number_integer();
    } catch (const nlohmann::json::exception&) {
    }
    if (!has_number) {
      throw InputError(lines_.file().string() + ":" + std::to_string(line_) +
                       ": expected the result of an episode as JSON");
    }
  }
  return episodes;
}

std::vector<nlohmann::ordered_json> RunFolder::SortEpisodes() const {
  const fs::path file = path_ / kEpisodesJsonl;
  auto episodes = EpisodeLines(file).Next();
  if (!fs::exists(file)) return episodes;
  std::sort(episodes.begin(), episodes.end(),
            [](const auto& a, const auto& b) { return a["episode"] < b["episode"]; });
  std::string text;
  for (const auto& episode : episodes) text += ToText(episode) + "\n";
  WriteWhole(file, text);
  return episodes;
}

void RunFolder::WriteJson(const std::string& name, const nlohmann::ordered_json& json) const {
  WriteWhole(path_ / name, ToText(json, 2) + "\n");
}

void RunFolder::AddEpisode(int episode, const nlohmann::ordered_json& result) const {
  const fs::path folder = fs::relative(EpisodeFolder(path_, episode), path_);
  fs::create_directories(path_ / folder);
  WriteJson((folder / kSummaryJson).string(), result);
  File lines(path_ / kEpisodesJsonl, O_RDWR | O_APPEND);
  // Another worker may be at it; one that was killed or found the disk full has left a part of a line.
  lines.Lock();
  lines.CutUnfinishedLine();
  lines.WriteSynced(ToText(result) + "\n");
}

void RunFolder::DiscardEpisode(int episode) const {
  fs::remove_all(EpisodeFolder(path_, episode));
  fs::remove_all(UnfinishedEpisodeFolder(path_, episode));
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

}  // namespace evalbus::results
