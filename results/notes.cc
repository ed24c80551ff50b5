#include "results/notes.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/number_from.h"
#include "base/write_whole.h"
#include "results/run_folder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;

std::optional<int> EpisodeOfKey(const std::string& key) {
  const auto episode = NumberFrom<int>(key);
  return episode && *episode >= 0 ? episode : std::nullopt;
}

}  // namespace

Notes ReadNotes(const fs::path& run) {
  const fs::path file = run / kNotesJson;
  Notes notes;
  if (!fs::exists(file)) return notes;
  const auto json = ReadJsonFile(file);
  if (!json.is_object()) throw InputError(file.string() + ": expected an object of notes by episode");
  for (const auto& [key, text] : json.items()) {
    const std::optional<int> episode = EpisodeOfKey(key);
    if (!episode || !text.is_string()) {
      throw InputError(fmt::format("{}: \"{}\": expected the number of an episode as key, and text as value",
                                   file.string(), key));
    }
    notes[*episode] = text.get<std::string>();
  }
  return notes;
}

void WriteNote(const fs::path& run, int episode, const std::string& text) {
  const fs::path file = run / kNotesJson;
  if (text.size() > kMaxNoteBytes) {
    throw InputError(fmt::format("a note has at most {} bytes; this one has {}", kMaxNoteBytes, text.size()));
  }
  // A link could lead out of the run's folder.
  if (fs::is_symlink(file)) throw InputError(file.string() + ": a link; notes are not written through links");
  const RunFilesLock lock(run);
  Notes notes = ReadNotes(run);
  if (text.empty()) {
    notes.erase(episode);
  } else {
    notes[episode] = text;
  }
  if (notes.size() > kMaxNotes) throw InputError(fmt::format("a run has at most {} notes", kMaxNotes));
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [number, note] : notes) json[std::to_string(number)] = note;
  WriteWhole(file, ToText(json, 2) + "\n");
}

std::optional<Notes> NotesFollower::Update() {
  struct stat status {};
  Version version{};
  if (stat((run_ / kNotesJson).c_str(), &status) == 0) {
    version = {status.st_ino, status.st_mtim.tv_sec * 1'000'000'000 + status.st_mtim.tv_nsec};
  }
  if (version_ == version) return std::nullopt;
  version_ = version;
  return ReadNotes(run_);
}

}  // namespace evalbus::results
