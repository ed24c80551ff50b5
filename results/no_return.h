// The point of no return of a failed episode: the last tick from which the task's expert still succeeds
// (docs/why.md). Kept in no_return.json of the run's folder; runner/no_return_finder.h finds it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace evalbus::results {

inline constexpr char kNoReturnJson[] = "no_return.json";

struct NoReturn {
  // What prevents the expert's success after the point.
  enum class Kind {
    kLost,       // the state: it fails even with twice the time limit
    kOutOfTime,  // the time that is left
    kNever,      // it fails from the start, too; there is no point
    kOpen,       // nothing: it succeeds from the last tick
  };
  Kind kind = Kind::kNever;
  // The last tick from which the expert succeeds, and its time since the episode began; 0 for kNever.
  int64_t tick = 0;
  double time_s = 0;
  // False if an earlier tick was found from which the expert fails.
  bool is_monotone = true;

  bool has_point() const { return kind == Kind::kLost || kind == Kind::kOutOfTime; }
};

// One sentence.
std::string NoReturnText(const NoReturn& point);

// By episode. Both throw InputError; AddNoReturns() also EnvironmentError. Reading a missing file gives none.
using NoReturns = std::map<int, NoReturn>;
NoReturns ReadNoReturns(const std::filesystem::path& run);
// Replaces the points of these episodes only. Several processes may do this at the same time.
void AddNoReturns(const std::filesystem::path& run, const NoReturns& points);
// The content of the file.
nlohmann::ordered_json NoReturnsJson(const NoReturns& points);

}  // namespace evalbus::results
