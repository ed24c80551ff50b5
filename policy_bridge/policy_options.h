// What a policy process is told: the part of a run's options that `evalbus run` and `evalbus-policy` share.
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
  // As FindPolicy takes it; a contract, by file or name; or the address of a server.
  std::string policy = "expert";
  // Of the server at such an address: as FindContract takes it.
  std::string contract{};
  // As ParseLatency takes it.
  std::string latency = "none";
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, PolicyOptions>
void ForEachOption(Options& options, const F& f) {
  constexpr bool kFixed = true;
  ForEachRow(
      std::tuple{
          Option{&PolicyOptions::policy, "policy",
                 PolicyHelp() +
                     "\nCONTRACT: a policy behind a server, by contract file or by name ('evalbus policy "
                     "list')\n"
                     "ws://HOST:PORT (tcp://, http://): the same at this address, with --contract\n"
                     "lcm: a process of yours on --url",
                 Range{}, kFixed},
          Option{&PolicyOptions::contract, "contract",
                 "what the server at --policy ws://... is shown and says: a file or one of 'evalbus policy "
                 "list'",
                 Range{}, kFixed},
          Option{&PolicyOptions::latency, "latency",
                 "lockstep: what a server's thinking costs in simulated time, during which the robot holds "
                 "its last\n"
                 "command: none (time stands still), measured, or milliseconds; rounded up to whole ticks",
                 Range{}, kFixed},
      },
      options, f);
}

// The contract that these options mean, with the address of its server; nothing where the policy is none
// behind a server. Throws InputError.
std::optional<Contract> FindContractOf(const PolicyOptions& options);

// What asks the policy's server for all processes that this one starts from now on; nothing where the policy
// is none of batches, or such a pool is there already. num_clients: how many play at the same time.
std::unique_ptr<PolicyPool> OpenPool(const PolicyOptions& options, int num_clients);

// What plays. Throws InputError, as FindPolicy and FindContractOf do.
PolicyMaker FindPolicy(const PolicyOptions& options);

}  // namespace evalbus::policy
