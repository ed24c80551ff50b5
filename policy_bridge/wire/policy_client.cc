#include "policy_bridge/wire/policy_client.h"

#include "base/errors.h"
#include "policy_bridge/wire/groot_client.h"
#include "policy_bridge/wire/openpi_client.h"
#include "policy_bridge/wire/rest_client.h"
#include "policy_bridge/wire/vla_eval_client.h"

namespace evalbus::policy {

std::unique_ptr<PolicyClient> MakePolicyClient(const ClientOptions& options) {
  switch (options.wire) {
    case Wire::kOpenpi:
    case Wire::kRoboArena:
      return MakeOpenpiClient(options);
    case Wire::kVlaEval:
      return MakeVlaEvalClient(options);
    case Wire::kGroot:
      return MakeGrootClient(options);
    case Wire::kRest:
      return MakeRestClient(options);
  }
  throw InputError(options.url + ": this wire is not built in");
}

}  // namespace evalbus::policy
