// The point of no return of a failed episode: the last tick from which the task's expert still succeeds
// (docs/why.md). runner/no_return_finder.h finds it; no_return.json in the run's folder stores it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace evalbus::results {

inline constexpr char kNoReturnJson[] = "no_return.json";

struct NoReturn {
  // Reason why the expert does not succeed after the point.
  enum class Kind {
    kLost,       // the expert fails even with twice the time limit
    kOutOfTime,  // the expert succeeds only with twice the time limit
    kNever,      // the expert fails even from tick 0; there is no point of no return
    kOpen,       // the expert succeeds even from the last tick
  };
  Kind kind = Kind::kNever;
  // The last tick from which the expert succeeds, and its time since the episode began; 0 for kNever.
  int64_t tick = 0;
  double time_s = 0;
  // False if an earlier tick was found from which the expert fails.
  bool is_monotone = true;

  bool has_point() const { return kind == Kind::kLost || kind == Kind::kOutOfTime; }
};

// Returns a description, for example "Point of no return at 3.20 s: from later ticks, the expert has too
// little time."
std::string NoReturnText(const NoReturn& point);

// Points by episode. ReadNoReturns() and AddNoReturns() throw InputError, and AddNoReturns() also
// EnvironmentError. Reading a missing file returns no points.
using NoReturns = std::map<int, NoReturn>;
NoReturns ReadNoReturns(const std::filesystem::path& run);
// Adds or replaces the points of these episodes and keeps all others. Several processes may call it at the
// same time.
void AddNoReturns(const std::filesystem::path& run, const NoReturns& points);
// Returns the contents of no_return.json.
nlohmann::ordered_json NoReturnsJson(const NoReturns& points);

}  // namespace evalbus::results
