#include "policy_bridge/wire/policy_client.h"

#include "base/errors.h"
#include "policy_bridge/wire/openpi_client.h"
#include "policy_bridge/wire/vla_eval_client.h"

namespace evalbus::policy {

std::unique_ptr<PolicyClient> MakePolicyClient(const ClientOptions& options) {
  switch (options.wire) {
    case Wire::kOpenpi:
    case Wire::kRoboArena:
      return MakeOpenpiClient(options);
    case Wire::kVlaEval:
      return MakeVlaEvalClient(options);
    case Wire::kGroot:  // MakeGrootClient(options)
    case Wire::kRest:   // MakeRestClient(options)
      break;
  }
  throw InputError(options.url + ": this wire is not built in");
}

}  // namespace evalbus::policy
