#include "policy_bridge/policy_options.h"

#include <cstdlib>

#include "base/errors.h"
#include "base/sha256.h"
#include "models/task_description.h"
#include "policy_bridge/policies/delayed_policy.h"
#include "policy_bridge/remote/remote_policy.h"

namespace evalbus::policy {
namespace {

// A process that is restarted during a run reads the contract again, so the file must not change.
Contract FindUnchanged(const std::string& name, const std::string& sha256) {
  Contract contract = FindContract(name);
  if (sha256.empty() || Sha256Text(contract.text) == sha256) return contract;
  throw InputError(contract.file.string() +
                   " changed during the run; restore it and use --resume, or start a new run");
}

}  // namespace

std::optional<Contract> FindContractOf(const PolicyOptions& options) {
  const std::string& policy = options.policy;
  if (policy.starts_with("grpc://")) throw InputError("--policy " + policy + ": " + kNoPickles);
  if (policy.find("://") != std::string::npos) {
    if (options.contract.empty()) {
      throw InputError("--policy " + policy +
                       ": requires --contract, the server's observations and actions ('evalbus policy list' "
                       "lists the built-in ones)");
    }
    Contract contract = FindUnchanged(options.contract, options.contract_sha256);
    contract.url = policy;
    return contract;
  }
  if (!options.contract.empty()) {
    throw InputError("--contract requires the address of a server, for example --policy ws://127.0.0.1:8000");
  }
  if (policy == kExternalPolicy || !IsContract(policy)) return std::nullopt;
  return FindUnchanged(policy, options.contract_sha256);
}

std::unique_ptr<PolicyPool> OpenPool(const PolicyOptions& options, int num_clients) {
  const std::optional<Contract> contract = FindContractOf(options);
  if (!contract || contract->batch_size == 1 || num_clients == 1 || std::getenv(kPoolVariable))
    return nullptr;
  auto pool = std::make_unique<PolicyPool>(ClientOptionsOf(*contract), contract->batch_size);
  setenv(kPoolVariable, pool->url().c_str(), 1);
  return pool;
}

PolicyMaker FindPolicy(const PolicyOptions& options) {
  Latency latency = ParseLatency(options.latency);
  latency.execution = ParseExecution(options.execution);
  if (const std::optional<Contract> contract = FindContractOf(options)) {
    MakePolicyClient(ClientOptionsOf(*contract));  // throws if the address is invalid
    CheckExecution(*contract, latency.execution);
    return [contract = *contract, latency](const mjModel& model, const model_info_t& info) {
      return std::make_unique<RemotePolicy>(contract, latency, model, info);
    };
  }
  const PolicyMaker make = FindPolicy(options.policy);
  if (latency.kind == Latency::Kind::kMeasured) {
    throw InputError(
        "--latency measured requires a policy behind a server; otherwise, expected none or milliseconds");
  }
  if (latency.kind == Latency::Kind::kFixed) {
    return [make, latency](const mjModel& model, const model_info_t& info) {
      return std::make_unique<DelayedPolicy>(make(model, info), latency, info);
    };
  }
  if (latency.execution != Execution::kSynchronous) {
    throw InputError("--execution " + options.execution + " requires --latency, or a policy behind a server");
  }
  return make;
}

}  // namespace evalbus::policy
