// Verdicts that operators gave on episodes, in verdicts.jsonl of the run's folder: one line per operator and
// episode.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::results {

inline constexpr char kVerdictsJsonl[] = "verdicts.jsonl";
inline constexpr size_t kMaxOperatorBytes = 100;
// Scale of the rubric: 0 to this.
inline constexpr double kMaxRubric = 10;

enum class Outcome { kFailure, kSuccess, kAbstain };
// The outcome in files and messages: "success", "failure" or "abstain".
const char* Word(Outcome outcome);
std::optional<Outcome> ParseOutcome(const std::string& word);

struct Verdict {
  int episode = 0;
  std::string operator_name{};
  Outcome outcome = Outcome::kAbstain;
  // Number of stages that the operator saw reached, and score from 0 to kMaxRubric, if they were given.
  std::optional<int> stages{};
  std::optional<double> rubric{};
  // UTC, "2026-11-26T23:15:07Z".
  std::string time{};
  // Position in the order in which the operator was shown the episodes, from 0, and the seed of that order;
  // no seed if the episodes of one run were shown in their own order.
  int place = 0;
  std::optional<int64_t> order_seed{};
};

// Throws InputError if the name is empty, too long or contains control characters.
void CheckOperatorName(const std::string& name);

// In the order of the file; empty if the run has none. Throws InputError with file, line and what was
// expected.
std::vector<Verdict> ReadVerdicts(const std::filesystem::path& run);

// Adds a verdict, or replaces that of the same operator on the same episode; the file is replaced atomically.
// Throws InputError if verdicts.jsonl is a link or cannot be read, or if the folder cannot be written;
// EnvironmentError if writing fails. Several processes may do this at the same time.
void WriteVerdict(const std::filesystem::path& run, const Verdict& verdict);

}  // namespace evalbus::results
