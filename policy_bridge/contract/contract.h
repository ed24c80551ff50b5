// Contract of a policy behind a server: what it observes, what the numbers of its actions mean, and how it is
// run. One YAML file per policy (docs/connecting_a_policy.md explains every key; models/policies/ contains
// the presets).
//
// No policy server describes itself well enough to be used safely. The contract therefore contains
// everything, and is compared with the server's own description, if any, before the first episode.
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
  enum class Source { kCamera, kDepth, kState, kPrompt, kConstant, kCounter, kCommitted };
  // The episode's index in its run; the control tick; the number of observations already sent in the episode,
  // 0 for the first one.
  enum class Counter { kEpisode, kTick, kObservation };
  // For real-time chunking: the rows of the last chunk from the observed tick on (rows x values, without rows
  // for the first chunk); the number of them that are executed before the answer arrives.
  enum class Committed { kActions, kDelaySteps };

  // Position in the observation: a key, or the keys of the nested maps down to the entry.
  std::vector<std::string> key;
  Source source = Source::kState;
  // For kCamera and kDepth.
  ImageForm image;
  // For kState: signals that are concatenated.
  std::vector<Signal> signals;
  // For kState and kDepth: "<f4", "<f8" or "|u1".
  std::string dtype = "<f4";
  // For kState: shape of the array. Unset: one dimension with all values. Empty ([] in the file): a scalar.
  std::optional<std::vector<int64_t>> shape;
  // Control ticks relative to now, oldest first ([-15, 0]); stacked along a new first axis. Empty: now,
  // without the axis.
  std::vector<int> history_ticks;
  // For kConstant.
  Value constant;
  Counter counter = Counter::kEpisode;
  Committed committed = Committed::kActions;

  bool is_image() const { return source == Source::kCamera || source == Source::kDepth; }
  // "observation/image", "images.cam_high"
  std::string KeyText() const;
};

struct Deadlines {
  // Deadlines in seconds: for the connection, for the first answer after it, for later answers; and how long
  // to wait for a server that has gone away.
  double connect_s = 10, first_reply_s = 600, reply_s = 30, return_s = 120;
};

struct Contract {
  std::string name, description;
  // Path of the file, and its text.
  std::filesystem::path file;
  std::string text;

  ClientOptions::GrootDialect groot_dialect = ClientOptions::GrootDialect::kDetect;
  Wire wire = Wire::kOpenpi;
  std::string url;
  // Environment variable that contains the API key; empty: no key is sent.
  std::string api_key_env;
  Deadlines deadlines;
  // Largest number of observations, of several workers, per request. Use more than 1 only if the server
  // answers each observation independently of the others and keeps no state during an episode.
  int batch_size = 1;

  // Control rate that the policy was trained for.
  double rate_hz = 20;
  // Ticks before the first observation, during which the robot holds its initial pose.
  int settle_steps = 0;
  // Realtime clock only: fraction of the control tick within which an answer must arrive to be executed at
  // the tick that it was requested at. Later answers are executed at the next tick.
  double answer_window = 0.5;

  std::vector<ObservationEntry> observation;
  // Runs or training sets with the demonstrations that the policy was trained on, as the file names them:
  // relative to the file's folder. `where`: file, line and key, for errors about the set.
  struct TrainingSet {
    std::string name, where;
  };
  std::vector<TrainingSet> trained_on;
  std::filesystem::path PathOf(const TrainingSet& set) const { return file.parent_path() / set.name; }
  // Prompt by task; other tasks use their own instruction.
  std::map<std::string, std::string> prompts;

  // Names of the answer's arrays, which are concatenated, and the meaning of their values.
  std::vector<std::string> action_keys;
  ActionSpace actions;
  // Number of steps of an action chunk: expected (nothing: any number), and executed.
  std::optional<int> chunk_steps;
  int execute_steps = 1;
  // Largest distance (rad) of a joint from its position that the episode's first action may command (absolute
  // actions). More indicates that an action is misinterpreted. Nothing: not checked.
  std::optional<double> first_step_rad;

  // Whether the observation contains anything that a real robot does not know (poses of objects).
  bool is_privileged() const;
  // Whether the observation contains images.
  bool needs_images() const;
  // Whether the server is sent the rows that are executed while it computes, so that it joins its chunks
  // itself.
  bool takes_committed_actions() const;
  std::string PromptFor(const std::string& task, const std::string& instruction) const;
};

// Error message: why LeRobot's protocol is not supported.
inline constexpr char kNoPickles[] =
    "LeRobot's gRPC server exchanges pickles, which execute the sender's code (CVE-2026-25874); serve the "
    "policy with evalbus.serve (docs/python.md) or vla-eval's server";

// Error about a contract that does not fit a robot or server; prefixed with the contract's file.
InputError InContract(const Contract& contract, const std::string& what);

// Returns make(); converts an error that the contract does not fit the robot to an InContract() error.
template <class F>
auto Fitted(const Contract& contract, const F& make) {
  try {
    return make();
  } catch (const InputError& error) {
    throw InContract(contract, error.what());
  }
}

// Both throw InputError with file, line, key and what was expected.
Contract ReadContract(const std::filesystem::path& file);
Contract ParseContract(const std::string& text, const std::filesystem::path& file);

// Whether this is the name of a contract file.
bool IsContractFile(const std::string& name);
// Whether this is the name of a contract file or of a preset.
bool IsContract(const std::string& name);
// Reads a file (*.yaml), or a preset by name. Throws InputError with the valid names.
Contract FindContract(const std::string& name);
// All presets, sorted by name.
std::vector<Contract> AllContracts();
std::filesystem::path PoliciesFolder();

// Environment variable through which a launcher passes the address of its pool to the processes of a run. The
// pool queries the server for all of them (wire/policy_pool.h).
inline constexpr char kPoolVariable[] = "EVALBUS_POLICY_POOL";

// Options of the client for this contract. The API key and, if batches are allowed, the pool come from the
// environment. Throws InputError if the key's variable is not set.
ClientOptions ClientOptionsOf(const Contract& contract);

const char* NameOf(Wire wire);

// The parts that affect results, for run.json and comparisons: wire, observation, actions, rate, steps; not
// the server's address.
nlohmann::ordered_json ContractJson(const Contract& contract);

}  // namespace evalbus::policy
