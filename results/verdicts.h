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
// Maximum rubric score; the minimum is 0.
inline constexpr double kMaxRubric = 10;

enum class Outcome { kFailure, kSuccess, kAbstain };
// Returns the outcome as in files and messages: "success", "failure" or "abstain".
const char* Word(Outcome outcome);
std::optional<Outcome> ParseOutcome(const std::string& word);

struct Verdict {
  int episode = 0;
  std::string operator_name{};
  Outcome outcome = Outcome::kAbstain;
  // stages: number of stages that were reached according to the operator. rubric: score from 0 to kMaxRubric.
  // nullopt if the operator did not give them.
  std::optional<int> stages{};
  std::optional<double> rubric{};
  // Time of the verdict in UTC, such as "2026-11-26T23:15:07Z".
  std::string time{};
  // place: position of the episode, from 0, in the order in which the operator was shown the episodes.
  // order_seed: seed of that order; nullopt if the episodes of a single run were shown in their own order.
  int place = 0;
  std::optional<int64_t> order_seed{};
  // RunIdentity() of the run that was judged together with this one. Empty for a single run, and for verdicts
  // of earlier builds, which did not record it.
  std::string other_run{};
};

// Throws InputError if the name is empty, too long or contains control characters.
void CheckOperatorName(const std::string& name);

// Returns the verdicts in the order of the file; empty if the run has none. Throws InputError with file, line
// and what was expected.
std::vector<Verdict> ReadVerdicts(const std::filesystem::path& run);

// Adds a verdict, or replaces an earlier verdict of the same operator on the same episode. The file is
// replaced atomically. Throws InputError if verdicts.jsonl is a link or cannot be read, or if the folder
// cannot be written; EnvironmentError if writing fails. Several processes may call it at the same time.
void WriteVerdict(const std::filesystem::path& run, const Verdict& verdict);

}  // namespace evalbus::results
