// Contract of a policy behind a server: what it observes, what the numbers of its actions mean, and how it is
// run. One YAML file per policy (docs/connecting_a_policy.md explains every key; models/policies/ contains
// the presets).
//
// No policy server describes itself completely enough to be used safely. Therefore the contract contains
// everything. Before the first episode, it is compared with the server's own description, if there is one.
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
  // kEpisode: the episode's index in its run. kTick: the control tick. kObservation: the number of
  // observations already sent in the episode, 0 for the first one.
  enum class Counter { kEpisode, kTick, kObservation };
  // Data for real-time chunking. kActions: the rows of the last chunk from the row of the observed tick on,
  // as an array of rows x values. The array has no rows before the first chunk and without --execution rtc.
  // kDelaySteps: the number of these rows that are expected to be executed before the answer arrives.
  enum class Committed { kActions, kDelaySteps };

  // Path of the entry in the observation: its key, preceded by the keys of the maps that contain it, if any.
  std::vector<std::string> key;
  Source source = Source::kState;
  // Used if `source` is kCamera or kDepth.
  ImageForm image;
  // Used if `source` is kState: signals whose values are concatenated.
  std::vector<Signal> signals;
  // Used if `source` is kState: "<f4", "<f8" or "|u1".
  std::string dtype = "<f4";
  // Used if `source` is kState: shape of the array. Unset: one dimension with all values. Empty ([] in the
  // file): a scalar.
  std::optional<std::vector<int64_t>> shape;
  // Control ticks to include, relative to the current one, oldest first, such as [-15, 0]. Their arrays are
  // stacked along a new first axis. Empty: only the current tick, without that axis.
  std::vector<int> history_ticks;
  // Used if `source` is kConstant.
  Value constant;
  Counter counter = Counter::kEpisode;
  Committed committed = Committed::kActions;

  bool is_image() const { return source == Source::kCamera || source == Source::kDepth; }
  // Returns the key as one text, such as "observation/image" or "images.cam_high".
  std::string KeyText() const;
};

struct Deadlines {
  // Deadlines in seconds for the connection, for the first answer after it, and for later answers. return_s:
  // how long the run waits for a server that cannot be reached or does not answer.
  double connect_s = 10, first_reply_s = 600, reply_s = 30, return_s = 120;
};

struct Contract {
  std::string name, description;
  // Path and text of the contract's file.
  std::filesystem::path file;
  std::string text;

  ClientOptions::GrootDialect groot_dialect = ClientOptions::GrootDialect::kDetect;
  Wire wire = Wire::kOpenpi;
  std::string url;
  // Environment variable that contains the API key. Empty: no key is sent.
  std::string api_key_env;
  Deadlines deadlines;
  // Largest number of observations (of different workers) in one request. Use more than 1 only if the server
  // answers each observation independently of the others and keeps no state during an episode.
  int batch_size = 1;

  // Control rate that the policy was trained for.
  double rate_hz = 20;
  // Number of ticks before the first observation. The robot holds its initial pose during them.
  int settle_steps = 0;
  // Used only with a real-time clock: an answer that arrives within this fraction of the control tick is
  // executed at the tick at which it was requested. A later answer is executed at a later tick.
  double answer_window = 0.5;

  std::vector<ObservationEntry> observation;
  // Run folders or training sets with the demonstrations that the policy was trained on. Names are relative
  // to the folder of the contract's file. `where`: file, line and key, for errors about the set.
  struct TrainingSet {
    std::string name, where;
  };
  std::vector<TrainingSet> trained_on;
  std::filesystem::path PathOf(const TrainingSet& set) const { return file.parent_path() / set.name; }
  // Prompts by task. For other tasks, the task's own instruction is the prompt.
  std::map<std::string, std::string> prompts;

  // Names of the answer's arrays, which are concatenated; and the meaning of the concatenated values.
  std::vector<std::string> action_keys;
  ActionSpace actions;
  // Expected number of steps in an action chunk (unset: any number); and number of steps that are executed.
  std::optional<int> chunk_steps;
  int execute_steps = 1;
  // Largest distance (rad) from its current position to which the policy's first action may move a joint
  // (absolute actions only). A larger distance indicates that actions are misinterpreted. Unset: not checked.
  std::optional<double> first_step_rad;

  // Returns whether the observation contains data that a real robot does not have (poses of objects).
  bool is_privileged() const;
  // Returns whether the observation contains images.
  bool needs_images() const;
  // Returns whether the server receives the rows that are executed while it computes. It then joins its
  // chunks itself.
  bool takes_committed_actions() const;
  std::string PromptFor(const std::string& task, const std::string& instruction) const;
};

// Error message that explains why LeRobot's protocol is not supported.
inline constexpr char kNoPickles[] =
    "LeRobot's gRPC server exchanges pickles, which execute the sender's code (CVE-2026-25874); serve the "
    "policy with evalbus.serve (docs/python.md) or vla-eval's server";

// Returns an error about a contract that does not fit a robot or server. Its text begins with the contract's
// file.
InputError InContract(const Contract& contract, const std::string& what);

// Returns make(). If make() throws an InputError, rethrows it as an InContract() error.
template <class F>
auto Fitted(const Contract& contract, const F& make) {
  try {
    return make();
  } catch (const InputError& error) {
    throw InContract(contract, error.what());
  }
}

// Read a contract. Both throw InputError with the file, line, key and expected value.
Contract ReadContract(const std::filesystem::path& file);
Contract ParseContract(const std::string& text, const std::filesystem::path& file);

// Returns whether `name` is the path of a contract file, as opposed to the name of a preset: it ends in .yaml
// or .yml, and has no colon.
bool IsContractFile(const std::string& name);
// Returns whether `name` is the name of a contract file or of a preset.
bool IsContract(const std::string& name);
// Reads a contract file (*.yaml), or a preset by name. Throws InputError with the valid names.
Contract FindContract(const std::string& name);
// Returns all presets, sorted by name.
std::vector<Contract> AllContracts();
std::filesystem::path PoliciesFolder();

// Environment variable with which a launcher passes the address of its pool to the processes of a run. The
// pool queries the server for all these processes (wire/policy_pool.h).
inline constexpr char kPoolVariable[] = "EVALBUS_POLICY_POOL";

// Options of the client for this contract. The API key and, if batches are allowed, the pool come from the
// environment. Throws InputError if the key's variable is not set.
ClientOptions ClientOptionsOf(const Contract& contract);

const char* NameOf(Wire wire);

// Returns the parts of a contract that affect results, for run.json and comparisons: wire, observation,
// actions, rate and steps, but not the server's address.
nlohmann::ordered_json ContractJson(const Contract& contract);

}  // namespace evalbus::policy
