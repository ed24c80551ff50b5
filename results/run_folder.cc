#include "results/run_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <functional>
#include <thread>

#include "base/errors.h"
#include "base/file_errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/write_whole.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;

// The processes of a killed run hold its lock until the last process has ended, shortly after the run.
constexpr auto kLockWait = std::chrono::milliseconds(500);

// A file that is opened for writing. Its functions throw if they fail.
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

  // Appends the whole text or, if the disk is full, nothing.
  void AppendSynced(const std::string& text) {
    const off_t before = lseek(fd_, 0, SEEK_END);
    for (size_t done = 0; done < text.size();) {
      const ssize_t n = write(fd_, text.data() + done, text.size() - done);
      if (n < 0 && errno != EINTR) {
        const int error = errno;
        // If this also fails, the next append removes the incomplete line.
        [[maybe_unused]] const int cut = ftruncate(fd_, before);
        errno = error;
        Check(false);
      }
      if (n > 0) done += static_cast<size_t>(n);
    }
    Check(fsync(fd_) == 0);
  }
  // The lock is held until this object is destroyed or the process ends.
  void Lock() { Check(flock(fd_, LOCK_EX) == 0); }
  // Removes an incomplete last line.
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
    if (!good) ThrowFileError("cannot write " + file_.string(), errno);
  }

  fs::path file_;
  int fd_;
};

bool IsTemporary(const std::string& name, const std::string& file) {
  const auto temporary = ParseTemporaryName(name);
  return temporary && temporary->file == file;
}

bool IsHalfWritten(const std::string& name) {
  const auto is_temporary = [&](const char* file) { return IsTemporary(name, file); };
  return std::ranges::any_of(std::array{kRunJson, kSuiteJson, kEpisodesJsonl, kSummaryJson}, is_temporary) ||
         std::ranges::any_of(kModelFiles, is_temporary);
}

// Returns true for the models of a run, finished or half-written.
bool IsModelFile(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename();
  return std::ranges::find(kModelFiles, name) != kModelFiles.end() || IsHalfWritten(name);
}

// Returns true if the folder contains only files that a run creates before its `mark`. A run that was killed
// so early left no results.
bool HoldsNothing(const fs::path& folder, const std::string& mark) {
  return std::ranges::all_of(fs::directory_iterator(folder), [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename();
    if (!entry.is_directory()) return IsTemporary(name, mark);
    return name == kLogsFolder
               ? fs::is_empty(entry)
               : name == kModelFolder && std::ranges::all_of(fs::directory_iterator(entry), IsModelFile);
  });
}

// Removes the files of a folder for whose names is_one() is true. Processes of a killed worker may still be
// ending, so files can disappear during the iteration.
void RemoveFiles(const fs::path& folder, const std::function<bool(const std::string& name)>& is_one) {
  std::error_code gone;
  for (auto entry = fs::directory_iterator(folder, gone); entry != fs::directory_iterator();
       entry.increment(gone)) {
    if (is_one(entry->path().filename()) && entry->is_regular_file(gone)) fs::remove(entry->path(), gone);
  }
}

void RemoveFilesOfEpisodes(const fs::path& run, const std::function<bool(const std::string& name)>& is_one) {
  for (const fs::path& episode : EpisodeFolders(run)) RemoveFiles(episode, is_one);
}

// Creates a folder and its missing parents, and adds the created ones to `made`.
void Make(const fs::path& folder, std::vector<fs::path>* made) {
  std::vector<fs::path> missing;
  for (fs::path path = folder; !fs::exists(path); path = path.parent_path()) missing.push_back(path);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) ThrowFileError("--out " + folder.string() + ": cannot create", error.value());
  made->insert(made->end(), missing.rbegin(), missing.rend());
}

// Creates runs/NAME-DATE-TIME, with a suffix if several runs start in the same second.
fs::path MakeNew(const std::string& name, std::vector<fs::path>* made) {
  const fs::path wish = fs::absolute(DatedFolder(name));
  fs::path folder = wish;
  for (int i = 2;; ++i) {
    Make(wish.parent_path(), made);
    if (mkdir(folder.c_str(), 0777) == 0) break;
    // A failed run may have removed runs/ in the meantime.
    if (errno != EEXIST && errno != ENOENT) ThrowFileError("cannot create " + folder.string(), errno);
    folder = wish.string() + "-" + std::to_string(i);
  }
  made->push_back(folder);
  return folder;
}

}  // namespace

fs::path DatedFolder(const std::string& name) {
  char stamp[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", std::localtime(&now));
  return fs::path("runs") / (name + "-" + stamp);
}

RunFolder::RunFolder(const fs::path& out, const std::string& name, bool resume, const std::string& mark) {
  path_ = out.empty() ? MakeNew(name, &made_) : fs::absolute(out).lexically_normal();
  if (!path_.has_filename()) path_ = path_.parent_path();
  const std::string shown = "--out " + (out.empty() ? path_ : out).string();
  const bool fresh = !fs::exists(path_) ||
                     (fs::is_directory(path_) && (resume ? HoldsNothing(path_, mark) : fs::is_empty(path_)));
  if (!fresh && !(resume && fs::exists(path_ / mark))) {
    throw InputError(shown + (resume ? ": exists, but contains nothing to resume; it has no " + mark
                                     : ": exists and is not an empty folder; choose another name, or add "
                                       "--resume to continue an interrupted run"));
  }
  Make(path_, &made_);
  lock_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) ThrowFileError(shown + ": cannot be opened", errno);
  const auto deadline = std::chrono::steady_clock::now() + kLockWait;
  while (lock_ >= 0 && flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      close(std::exchange(lock_, -1));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  if (lock_ < 0) throw InputError(shown + ": another command is using this folder");
  Make(path_ / kLogsFolder, &made_);
}

fs::path RunFolder::shown() const {
  const fs::path near = fs::proximate(path_);
  return near.string().starts_with("..") ? path_ : near;
}

bool IsInUse(const fs::path& folder) {
  const auto is_locked = [](const fs::path& path) {
    const int file = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0) return false;
    // This lock is held only until close(). RunFolder waits up to kLockWait for it.
    const bool is_free = flock(file, LOCK_SH | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    close(file);
    return !is_free;
  };
  const fs::path full = fs::absolute(folder).lexically_normal();
  return is_locked(full) || (fs::exists(full.parent_path() / kSuiteJson) && is_locked(full.parent_path()));
}

RunFolder RunFolder::OfWorker(const fs::path& folder) {
  RunFolder run;
  run.path_ = fs::absolute(folder).lexically_normal();
  return run;
}

RunFolder::~RunFolder() {
  if (lock_ >= 0) close(lock_);
}

void RunFolder::DiscardAllBut(const std::set<int>& finished) const {
  for (const fs::path& episode : EpisodeFolders(path_)) {
    if (!finished.contains(*EpisodeOfFolder(episode)) || IsUnfinished(episode)) fs::remove_all(episode);
  }
  RemoveHalfWritten();
  RemoveHalfWrittenVideos();
}

void RunFolder::RemoveHalfWritten() const {
  RemoveFiles(path_, IsHalfWritten);
  RemoveFiles(path_ / kModelFolder, IsHalfWritten);
  RemoveFilesOfEpisodes(path_, IsHalfWritten);
}

void RunFolder::RemoveHalfWrittenVideos(std::optional<pid_t> by) const {
  RemoveFilesOfEpisodes(path_, [by](const std::string& name) {
    const auto temporary = ParseTemporaryName(name);
    const auto is_video = [&](const char* ending) { return temporary->file.ends_with(ending); };
    return temporary && (is_video(".mp4") || is_video(".gif") || is_video(".webp")) &&
           (!by || temporary->pid == *by);
  });
}

void RunFolder::Remove() const {
  if (fs::exists(path_ / kEpisodesJsonl)) return;
  RemoveHalfWritten();
  std::error_code ignored;
  for (const char* name : {kRunJson, kSuiteJson, kSummaryJson, kModelFolder, kEpisodesFolder, kLogsFolder}) {
    fs::remove_all(path_ / name, ignored);
  }
  for (auto path = made_.rbegin(); path != made_.rend(); ++path) fs::remove(*path, ignored);
}

std::vector<std::string> NewLines::Next() {
  std::vector<std::string> lines;
  if (!fs::exists(file_)) return lines;
  const InputFile input(file_);
  std::string text;
  std::array<char, 65536> block{};
  while (const size_t n = input.ReadAt(position_ + text.size(), block)) text.append(block.data(), n);
  size_t begin = 0;
  for (size_t end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    lines.push_back(text.substr(begin, end - begin));
  }
  position_ += begin;
  return lines;
}

std::vector<nlohmann::ordered_json> EpisodeLines::Next() {
  std::vector<nlohmann::ordered_json> episodes;
  for (const std::string& text : lines_.Next()) {
    episodes.push_back(ParseJson<nlohmann::ordered_json>(text, lines_.file().string(), ++line_));
    const auto& episode = episodes.back();
    if (!episode.is_object() || !episode.contains("episode") || !episode["episode"].is_number_integer()) {
      throw InputError(lines_.file().string() + ":" + std::to_string(line_) +
                       ": expected the result of an episode as JSON");
    }
  }
  return episodes;
}

void RunFolder::WriteEpisodes(const std::vector<nlohmann::ordered_json>& results) const {
  std::string text;
  for (const auto& result : results) text += ToText(result) + "\n";
  WriteWhole(path_ / kEpisodesJsonl, text);
}

void RunFolder::WriteJson(const std::string& name, const nlohmann::ordered_json& json) const {
  WriteWhole(path_ / name, ToText(json, 2) + "\n");
}

void RunFolder::AddPolicyCalls(int episode, const nlohmann::ordered_json& calls) const {
  WriteJson((fs::relative(EpisodeFolder(path_, episode), path_) / kPolicyCallsJson).string(), calls);
}

void RunFolder::AddEpisode(int episode, const nlohmann::ordered_json& result) const {
  const fs::path folder = fs::relative(EpisodeFolder(path_, episode), path_);
  fs::create_directories(path_ / folder);
  WriteJson((folder / kSummaryJson).string(), result);
  File lines(path_ / kEpisodesJsonl, O_RDWR | O_APPEND);
  // Another worker may be appending; a worker that was killed or found the disk full may have left an
  // incomplete line.
  lines.Lock();
  lines.CutUnfinishedLine();
  lines.AppendSynced(ToText(result) + "\n");
}

void RunFolder::DiscardEpisode(int episode) const {
  fs::remove_all(EpisodeFolder(path_, episode));
  fs::remove_all(UnfinishedEpisodeFolder(path_, episode));
}

RunFilesLock::RunFilesLock(const std::filesystem::path& run) {
  const std::filesystem::path folder = run / kEpisodesFolder;
  fd_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd_ < 0) ThrowFileError(folder.string() + ": cannot be opened", errno);
  int result = 0;
  do {
    result = flock(fd_, LOCK_EX);
  } while (result != 0 && errno == EINTR);
  if (result == 0) return;
  const int error = errno;
  close(fd_);
  ThrowFileError(folder.string() + ": cannot be locked", error);
}

RunFilesLock::~RunFilesLock() { close(fd_); }

}  // namespace evalbus::results
