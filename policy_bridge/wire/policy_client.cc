#include "policy_bridge/wire/policy_client.h"

#include "base/text.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/policy_pool.h"

namespace evalbus::policy {

std::vector<Reply> PolicyClient::InferBatch(std::span<const Value> observations) {
  std::vector<Reply> replies;
  for (const Value& observation : observations) replies.push_back(Infer(observation));
  return replies;
}

std::unique_ptr<PolicyClient> MakePolicyClient(const ClientOptions& options) {
  if (!options.pool_url.empty()) return MakePoolClient(options);
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
    case Wire::kXPolicyLab:
      return MakeXPolicyLabClient(options);
  }
  return nullptr;
}

ServerError ErrorFromServer(const std::string& words) {
  constexpr const char* kSpaces = " \t\r\n";
  std::string last = words.substr(0, words.find_last_not_of(kSpaces) + 1);
  last.erase(0, last.find_last_of("\r\n") + 1);
  last.erase(0, last.find_first_not_of(kSpaces));
  return {ServerError::Kind::kServer,
          last.empty() ? "the server fails without a message"
                       : "the server reports: " + Printable(Cut(last, 400)),
          words};
}

}  // namespace evalbus::policy
