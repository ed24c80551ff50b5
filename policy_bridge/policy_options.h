// Options of a policy process, shared by `evalbus run` and `evalbus-policy`.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "base/options.h"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/factory.h"
#include "policy_bridge/wire/policy_pool.h"

namespace evalbus::policy {

struct PolicyOptions {
  // Policy to run: a name that FindPolicy accepts, the file or name of a contract, or the address of a
  // server.
  std::string policy = "expert";
  // Contract for the server if `policy` is an address: a file or name that FindContract accepts.
  std::string contract{};
  // Simulated time that an inference takes: a string that ParseLatency accepts.
  std::string latency = "none";
  // What the robot does during an inference: a string that ParseExecution accepts.
  std::string execution = "synchronous";
  // Hash of the contract's file, if the launcher has read it for all processes of the run; otherwise empty.
  std::string contract_sha256{};
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, PolicyOptions>
void ForEachOption(Options& options, const F& f) {
  constexpr bool kFixed = true;
  ForEachRow(
      std::tuple{
          Option{&PolicyOptions::policy, "policy",
                 PolicyHelp() +
                     "\nCONTRACT: a policy on a server, given by a contract file or a name from 'evalbus "
                     "policy list'\n"
                     "ws://HOST:PORT (tcp://, http://): the same at this address, with --contract\n"
                     "lcm: your own process on the bus --url",
                 Range{}, kFixed},
          Option{&PolicyOptions::contract, "contract",
                 "contract (observations and actions) of the server at --policy ws://...: a file, or one of "
                 "'evalbus policy list'",
                 Range{}, kFixed},
          Option{&PolicyOptions::latency, "latency",
                 "simulated time that an inference takes in lockstep: none (time is paused), measured "
                 "(servers only),\nor milliseconds; rounded up to whole ticks (docs/latency.md)",
                 Range{}, kFixed},
          Option{&PolicyOptions::execution, "execution",
                 "what the robot does during an inference: synchronous (holds its last command), "
                 "asynchronous\n(executes the last action chunk), rtc (the same, and blends it into the next "
                 "chunk)",
                 Range{}, kFixed},
          Option{&PolicyOptions::contract_sha256, "contract_sha256"},
      },
      options, f);
}

// Returns the contract selected by these options, with the address of its server. Returns nullopt if the
// policy is not behind a server. Throws InputError, for example if the file does not have the hash
// contract_sha256.
std::optional<Contract> FindContractOf(const PolicyOptions& options);

// Creates the pool that queries the policy's server for all processes that this process starts from now on.
// Returns null if the policy does not support batches, if num_clients is 1, or if a pool exists already.
// num_clients: number of processes that query the server at the same time.
std::unique_ptr<PolicyPool> OpenPool(const PolicyOptions& options, int num_clients);

// Creates the policy selected by these options. Throws the errors of FindPolicy() and FindContractOf().
PolicyMaker FindPolicy(const PolicyOptions& options);

}  // namespace evalbus::policy
