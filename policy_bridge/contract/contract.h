// What a policy behind a server is shown, what its numbers mean, and how it is run: one YAML file per policy
// (docs/connecting_a_policy.md explains every key; models/policies/ has the presets).
//
// No policy server says enough of itself to be used safely, so all of it stands here and is compared with
// what the server does say before the first episode.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/errors.h"
#include "policy_bridge/actions/action_space.h"
#include "policy_bridge/contract/image_form.h"
#include "policy_bridge/contract/signal.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// One entry of the observation.
struct ObservationEntry {
  enum class Source { kCamera, kDepth, kState, kPrompt, kConstant, kCounter };
  // The episode's index in its run; the control tick; the number of observations sent before this one in the
  // episode, which is 0 in the first one.
  enum class Counter { kEpisode, kTick, kObservation };

  // Where it stands: one key, or that of each map on the way to it.
  std::vector<std::string> key;
  Source source = Source::kState;
  // kCamera, kDepth.
  ImageForm image;
  // kState: signals one after the other.
  std::vector<Signal> signals;
  // kState, kDepth: "<f4", "<f8" or "|u1".
  std::string dtype = "<f4";
  // kState: as it is sent; empty: one row of all values, [] in the file: one number.
  std::optional<std::vector<int64_t>> shape;
  // Control ticks before now, oldest first ([-15, 0]); stacked along a new first axis. Empty: now, no axis.
  std::vector<int> history_ticks;
  // kConstant.
  Value constant;
  Counter counter = Counter::kEpisode;

  bool is_image() const { return source == Source::kCamera || source == Source::kDepth; }
  // "observation/image", "images.cam_high"
  std::string KeyText() const;
};

struct Deadlines {
  // A connection; the first answer after it; later ones; how long a server that is gone is waited for. s
  double connect_s = 10, first_reply_s = 600, reply_s = 30, return_s = 120;
};

struct Contract {
  std::string name, description;
  // Of the file, and its text.
  std::filesystem::path file;
  std::string text;

  ClientOptions::GrootDialect groot_dialect = ClientOptions::GrootDialect::kDetect;
  Wire wire = Wire::kOpenpi;
  std::string url;
  // Name of the environment variable with the key; empty: none is sent.
  std::string api_key_env;
  Deadlines deadlines;
  // How many observations of several workers a request may have. More than 1: the server answers each by
  // itself, whatever else it is asked, and keeps nothing of an episode.
  int batch_size = 1;

  // Control rate that the policy was trained for.
  double rate_hz = 20;
  // Ticks before the first observation, for which the robot is held where it starts.
  int settle_steps = 0;
  // On a realtime clock: an answer that arrives within this part of the control tick that it was asked at is
  // executed at that tick, a later one at the next tick.
  double answer_window = 0.5;

  std::vector<ObservationEntry> observation;
  // By task; what is not here is the task's own instruction.
  std::map<std::string, std::string> prompts;

  // Names of the arrays of the answer, put side by side, and what their numbers mean.
  std::vector<std::string> action_keys;
  ActionSpace actions;
  // Steps of a chunk: how many are expected (nothing: any number), and executed.
  std::optional<int> chunk_steps;
  int execute_steps = 1;
  // A joint of the first action of an episode may be so far from where it is, rad (absolute actions: farther
  // means that something is misunderstood). Nothing: not checked.
  std::optional<double> first_step_rad;

  // Of its cameras and signals: whether anything is shown that a robot cannot know (poses of objects).
  bool is_privileged() const;
  // Whether it wants images.
  bool needs_images() const;
  std::string PromptFor(const std::string& task, const std::string& instruction) const;
};

// Why LeRobot's server is not among the wires.
inline constexpr char kNoPickles[] =
    "LeRobot's gRPC server speaks in pickles, which run the code of whoever sends them (CVE-2026-25874); "
    "serve the "
    "policy with evalbus.serve (docs/python.md) or vla-eval's server";

// What is wrong with a contract for some robot or server, with its file before it.
InputError InContract(const Contract& contract, const std::string& what);

// What `make` makes of a contract for a robot; where that does not fit, an InContract.
template <class F>
auto Fitted(const Contract& contract, const F& make) {
  try {
    return make();
  } catch (const InputError& error) {
    throw InContract(contract, error.what());
  }
}

// Throws InputError: file, line, key, what was expected.
Contract ReadContract(const std::filesystem::path& file);
Contract ParseContract(const std::string& text, const std::filesystem::path& file);

// Whether this is the name of such a file; of one, or of a preset.
bool IsContractFile(const std::string& name);
bool IsContract(const std::string& name);
// A file (*.yaml), or one of the presets by name. Throws InputError with the names there are.
Contract FindContract(const std::string& name);
// By name.
std::vector<Contract> AllContracts();
std::filesystem::path PoliciesFolder();

// Names, for the processes of a run, the pool that asks the server for all of them (wire/policy_pool.h).
inline constexpr char kPoolVariable[] = "EVALBUS_POLICY_POOL";

// What the client of this contract is made with; api key and, where there may be batches, pool from the
// environment. Throws InputError if the key's variable is not set.
ClientOptions ClientOptionsOf(const Contract& contract);

const char* NameOf(Wire wire);

// What decides about a result, for run.json and comparisons: wire, observation, actions, rate, steps; not
// where the server is.
nlohmann::ordered_json ContractJson(const Contract& contract);

}  // namespace evalbus::policy
