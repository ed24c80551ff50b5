#include "cli/launch/run_options.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "policy_bridge/policy_component.h"

namespace evalbus::launch {

void CheckRunOptions(const RunOptions& options, size_t num_tasks) {
  sim::CheckSimOptions(options.sim);
  CheckRanges(options);
  if (options.resume && options.out.empty()) {
    throw InputError("--resume: expected --out, too: the folder of the run that is to go on");
  }
  if (options.in_process && !options.url.empty())
    throw InputError("--in-process and --url exclude each other");
  if (options.by_hand &&
      (options.in_process || options.url.empty() || num_tasks > 1 || options.workers > 1)) {
    throw InputError(
        "--by-hand: expected one task, one worker and --url or EVALBUS_URL, the bus of the processes, as "
        "udpm://239.255.76.67:7667?ttl=0");
  }
  if (Printable(options.policy_name) != options.policy_name) {
    throw InputError("--policy-name: expected text without control characters");
  }
  if (options.workers > 1 && !options.url.empty()) {
    throw InputError("--workers and --url exclude each other: each worker has a bus of its own");
  }
  if (options.policy.policy == kExternalPolicy) {
    if (options.url.empty() || num_tasks > 1) {
      throw InputError(
          "--policy lcm: expected one task, and with --url or EVALBUS_URL the bus on which the policy is, as "
          "udpm://239.255.76.67:7667?ttl=0");
    }
  } else {
    policy::CheckPolicy(options.policy.policy);
  }
  if (num_tasks > 1 && !options.url.empty()) {
    throw InputError("--url: expected one task; each run of a suite has a bus of its own");
  }
  for (const int episode : options.only) {
    if (episode < options.episodes) continue;
    throw InputError(fmt::format("--only {}: expected 0 to {}, since --episodes is {}", episode,
                                 options.episodes - 1, options.episodes));
  }
}

}  // namespace evalbus::launch
