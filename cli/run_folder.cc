#include "cli/run_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <set>

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

RunFolder::RunFolder(const fs::path& folder, bool resume, const std::string& mark)
    : path_(fs::absolute(folder).lexically_normal()) {
  std::error_code error;
  const bool fresh = !fs::exists(path_) || (fs::is_directory(path_) && fs::is_empty(path_, error));
  if (!fresh && !(resume && fs::exists(path_ / mark))) {
    throw InputError("--out " + folder.string() +
                     (resume
                          ? ": exists and holds nothing to resume; it has no " + mark
                          : ": exists and is not an empty folder; choose another name, or add --resume to go "
                            "on with what was interrupted"));
  }
  fs::create_directories(path_ / "logs", error);
  if (error) throw InputError("--out " + folder.string() + ": cannot create: " + error.message());
  lock_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0 || flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    throw InputError("--out " + folder.string() + ": another 'evalbus run' is at work in it");
  }
  if (!fresh && mark == "run.json") Clean();
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
  for (const auto& entry : fs::directory_iterator(path_ / "episodes", none_there)) {
    if (!finished.contains(entry.path())) fs::remove_all(entry.path());
  }
  for (const auto& entry : fs::recursive_directory_iterator(path_)) {
    if (entry.path().extension() == ".tmp") fs::remove(entry.path());
  }
}

std::vector<nlohmann::ordered_json> EpisodeLines::Next() {
  std::vector<nlohmann::ordered_json> episodes;
  std::ifstream stream(file_);
  stream.seekg(position_);
  std::string text;
  while (std::getline(stream, text) && !stream.eof()) {
    position_ = stream.tellg();
    ++line_;
    try {
      episodes.push_back(nlohmann::ordered_json::parse(text));
      episodes.back().at("episode").get<int>();
    } catch (const nlohmann::json::exception&) {
      throw InputError(file_.string() + ":" + std::to_string(line_) +
                       ": expected the result of an episode as JSON");
    }
  }
  return episodes;
}

std::vector<nlohmann::ordered_json> RunFolder::SortEpisodes() const {
  const fs::path file = path_ / "episodes.jsonl";
  auto episodes = EpisodeLines(file).Next();
  if (!fs::exists(file)) return episodes;
  std::sort(episodes.begin(), episodes.end(),
            [](const auto& a, const auto& b) { return a["episode"] < b["episode"]; });
  std::string text;
  for (const auto& episode : episodes) text += episode.dump() + "\n";
  WriteSynced(file.string() + ".tmp", text, O_TRUNC);
  fs::rename(file.string() + ".tmp", file);
  return episodes;
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
