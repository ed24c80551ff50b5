// Simulated time that an inference of a policy takes.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "base/errors.h"
#include "base/number_from.h"
#include "policy_bridge/actions/chunk_schedule.h"

namespace evalbus::policy {

// Simulated time that an inference takes in lockstep: none (the simulation stands still), the measured
// wall-clock time, or a fixed time. `execution`, which also applies in real time, defines what the robot does
// during the inference.
struct Latency {
  enum class Kind { kNone, kMeasured, kFixed };
  Kind kind = Kind::kNone;
  double fixed_s = 0;
  Execution execution = Execution::kSynchronous;
};

// Parses the value of `option` as a delay in milliseconds, at most one minute. expected: description of valid
// values, for the error message. Throws InputError.
inline Latency ParseDelay(const std::string& text, const std::string& option, const std::string& expected) {
  constexpr double kLongest = 60e3;  // ms
  const double ms = NumberFrom<double>(text).value_or(-1);
  if (!(ms >= 0 && ms <= kLongest))
    throw InputError(option + ": expected " + expected + ", got '" + text + "'");
  return {Latency::Kind::kFixed, ms / 1e3};
}

// Parses "none", "measured" or milliseconds, as in --latency. Throws InputError.
inline Latency ParseLatency(const std::string& text) {
  if (text == "none") return {};
  if (text == "measured") return {Latency::Kind::kMeasured};
  return ParseDelay(text, "--latency", "none, measured or milliseconds");
}

// Returns the number of ticks that pass during a call which takes this much simulated time, rounded up.
inline int64_t HeldTicks(double charged_s, double tick_s) {
  return static_cast<int64_t>(std::ceil(charged_s / tick_s - 1e-9));
}

}  // namespace evalbus::policy
