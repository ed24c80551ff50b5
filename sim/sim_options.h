// Sim options that `evalbus run` and `evalbus-sim` share.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <tuple>
#include <vector>

#include "base/options.h"
#include "base/random.h"
#include "base/text.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/source.h"
#include "models/model_sources.h"

namespace evalbus::sim {

struct SimOptions {
  // Names or files of the task and the robot; see FindTask.
  std::string task;
  std::string robot;
  std::vector<std::filesystem::path> model_path;
  std::vector<std::string> assets;
  // MuJoCo version for the simulation; empty for the version that this program is linked with.
  std::string engine;
  double control_hz = 50;
  bool realtime = false;
  double rtf = 1;
  double policy_timeout_s = 60;
  double after_success_s = 0;
  // File of force limits (models/force_limits.h), or empty.
  std::string limits;
  // kRunSeeds, kCollectSeeds, kRoboEvalSeeds or kSharedSeeds (base/random.h).
  std::string seed_stream = kRunSeeds;
  // Id of the run, which MODEL contains.
  std::string run_id = "run";
  // Only for a source (`evalbus watch`). source_timeout_s: a source that is silent for this long has ended
  // its episode. gripper: fixed openings of grippers whose fingers the source does not measure, "left=open".
  double source_timeout_s = 5;
  std::vector<std::string> gripper;
  // Only for a source. contacts: where contacts come from, "shapes" (the collision checker) or "source" (the
  // source itself). map: file with the source's names, zeros and frames (source_map.h), or empty.
  std::string contacts = contacts_from::kShapes;
  std::string map;
  // Digests of the models in OUT/model/, and warnings, if the launcher has composed the scene for all
  // processes of the run. If they are empty, the sim composes the scene and writes the models to OUT/model/.
  std::string physics_sha256, visual_sha256;
  std::vector<std::string> scene_warnings;

  // The following are not in the table below, so run.json does not store them. out: run folder; the models
  // are written to OUT/model/.
  std::filesystem::path out;
  // True if ticks are times of a source or a file; nothing is simulated.
  bool is_source = false;
  // Maximum wall-clock time to wait for a score, or for a component that lags behind, unless in
  // real time.
  double metrics_timeout_s = 10;
  // If not zero, runs this many episodes without waiting for a COMMAND, then exits.
  int episodes = 0;
  int64_t seed = 0;
  // Components that must be ready before tick 0 of these episodes.
  std::vector<std::string> required = {"collision", "metrics", "policy"};

  ModelSources sources() const { return {model_path, assets}; }
};

// Several months: effectively no timeout, but still a duration that can be added to a time without overflow.
inline constexpr double kLongestTimeout = 1e7;  // s

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, SimOptions>
void ForEachOption(Options& options, const F& f) {
  constexpr bool kFixed = true;
  ForEachRow(
      std::tuple{
          Option{&SimOptions::task, "task_path"},
          Option{&SimOptions::robot, "robot",
                 "robot that replaces the task's own: a name in models/robots, or a robot description (YAML)",
                 Range{}, kFixed},
          Option{&SimOptions::model_path, "model_path",
                 "folder to look for MJCF files in, e.g. a MuJoCo Menagerie"},
          Option{&SimOptions::assets, "assets",
                 "NAME=FOLDER: files of a task that are not part of evalbus, e.g. roboeval=CHECKOUT"},
          Option{&SimOptions::engine, "engine",
                 "MuJoCo version for the simulation, e.g. 3.3.3 or 3.3; 'scripts/engine VERSION' builds its "
                 "sim;\n"
                 "default: the version of the installed package",
                 Range{}, kFixed},
          Option{&SimOptions::control_hz, "control_hz",
                 "control ticks per simulated second, 5 to 500; a tick is rounded to whole physics "
                 "steps;\ndefault: the rate of the policy's contract, otherwise 50",
                 Range{5, 500}, kFixed},
          Option{&SimOptions::realtime, "realtime", "pace by the wall clock; default: lockstep", Range{},
                 kFixed},
          Option{&SimOptions::rtf, "rtf", "with --realtime: simulated seconds per second of wall time",
                 Range{0.001, 1e6}, kFixed},
          Option{&SimOptions::policy_timeout_s, "policy_timeout_s",
                 "lockstep: maximum time to wait for an action, s", Range{0.001, kLongestTimeout}, kFixed},
          Option{&SimOptions::after_success_s, "after_success_s",
                 "continue for this many simulated seconds (whole ticks) after the first success, and report "
                 "whether\nthe success lasts",
                 Range{0, 1e6}, kFixed},
          Option{&SimOptions::limits, "limits",
                 "YAML file of force limits for regions of bodies (docs/limits.md); violations are counted "
                 "and explained",
                 Range{}, kFixed},
          Option{&SimOptions::seed_stream, "seed_stream",
                 "scheme that derives the starts from the seed; roboeval/1: episode N starts like "
                 "RoboEval's\nenv.reset(seed=SEED+N)",
                 Range{}, kFixed},
          Option{&SimOptions::run_id, "run_id"},
          Option{&SimOptions::source_timeout_s, "source_timeout_s", "", Range{0.1, 3600}},
          Option{&SimOptions::gripper, "gripper"},
          Option{&SimOptions::contacts, "contacts"},
          Option{&SimOptions::map, "map"},
          Option{&SimOptions::physics_sha256, "physics_sha256"},
          Option{&SimOptions::visual_sha256, "visual_sha256"},
          Option{&SimOptions::scene_warnings, "scene_warnings"},
      },
      options, f);
}

// Replaces the requested rate by a possible one. For a sim, the tick is rounded to whole physics steps; for a
// source, to whole microseconds. If the rate was changed, returns a line that reports the change; otherwise
// an empty string. Throws InputError if an option is out of range.
inline std::string MakeControlRateReal(int64_t timestep_us, SimOptions* options) {
  CheckRanges(*options);
  const double asked = options->control_hz;
  const double real =
      options->is_source ? SourceHz(std::llround(1e6 / asked)) : RealControlHz(asked, timestep_us);
  options->control_hz = real;
  CheckRanges(*options);
  if (std::abs(real - asked) <= 1e-9 * asked) return {};
  const std::string rates = fmt::format("control rate: {:.5g} Hz instead of {:.8g} Hz; ", real, asked);
  if (options->is_source) return rates + "the tick of a source is a whole number of microseconds";
  return rates + fmt::format("a tick is {} of {:g} ms", Plural(Substeps(real, timestep_us), "physics step"),
                             static_cast<double>(timestep_us) / 1e3);
}

// Returns the absolute path of a file of force limits; empty if `limits` is empty.
inline std::string AbsoluteLimits(const std::string& limits) {
  return limits.empty() ? "" : std::filesystem::absolute(limits).lexically_normal().string();
}

// Throws InputError if the seed stream is kRoboEvalSeeds and RoboEval does not accept the seeds of these
// episodes.
inline void CheckSeeds(const std::string& seed_stream, int64_t seed, int64_t episodes) {
  if (seed_stream != kRoboEvalSeeds || (seed >= 0 && seed <= kMaxRoboEvalSeed + 1 - episodes)) return;
  throw InputError(fmt::format("--seed-stream {}: expected seeds from 0 to {}, got --seed {} and {}",
                               seed_stream, kMaxRoboEvalSeed, seed, Plural(episodes, "episode")));
}

// Throws InputError if the options are invalid or contradict each other.
inline void CheckSimOptions(const SimOptions& options) {
  CheckRanges(options);
  contacts_from::Check(options.contacts);
  if (!IsSeedStream(options.seed_stream)) {
    throw InputError(fmt::format("--seed-stream: expected {}, {} or {}, got '{}'", kRunSeeds, kCollectSeeds,
                                 kRoboEvalSeeds, options.seed_stream));
  }
  if (options.rtf != 1 && !options.realtime) throw InputError("--rtf requires --realtime");
}

}  // namespace evalbus::sim
