// Users' notes on episodes: at most one per episode, stored in notes.json in the run folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace evalbus::results {

inline constexpr char kNotesJson[] = "notes.json";
// Maximum length of a note in bytes, and maximum number of notes of a run.
inline constexpr size_t kMaxNoteBytes = 2000, kMaxNotes = 10'000;

// Texts of the notes by episode.
using Notes = std::map<int, std::string>;

// Returns an empty map if the run has no notes. Throws InputError with the file and what was expected.
Notes ReadNotes(const std::filesystem::path& run);

// Sets the note of an episode, or removes it if `text` is empty; the file is replaced atomically. Throws
// InputError if the text is too long, if there are too many notes, if notes.json is a link or cannot be read,
// or if the folder cannot be written; EnvironmentError if writing fails. Several processes may call it at the
// same time.
void WriteNote(const std::filesystem::path& run, int episode, const std::string& text);

// Reads notes.json again whenever it has changed.
class NotesFollower {
 public:
  explicit NotesFollower(std::filesystem::path run) : run_(std::move(run)) {}
  // Returns nullopt if the file is unchanged since the last call; the first call returns all notes. Throws
  // the InputError of ReadNotes(), at most once per change.
  std::optional<Notes> Update();

 private:
  // Inode and modification time. The inode changes because notes.json is replaced, not modified.
  using Version = std::pair<uint64_t, int64_t>;

  std::filesystem::path run_;
  std::optional<Version> version_;
};

}  // namespace evalbus::results
