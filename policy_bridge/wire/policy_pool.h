// Lets several processes query a policy server as one client: pending observations are combined into one
// request. For servers that support batches and keep no state during an episode. The beginning of an episode
// is not forwarded, because it would affect all clients.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Queries the server on a thread of its own. Observations that arrive while the server is busy form the next
// batch. Before a request, the pool also waits for the clients that are expected to send soon: those that
// have connected, or were answered, in one of the last two requests. Otherwise two clients that happen to
// alternate would never share a batch. It waits at most as long as the last request took (and at most 1 s),
// so waiting costs no more than separate requests.
//
// An answer depends on its own observation only: if the server reports a failure, the observations of the
// batch are sent again one by one, and each client receives its own result. A lost connection or a timeout
// fails all observations of the batch; the next batch reconnects.
class PolicyPool {
 public:
  static constexpr std::chrono::milliseconds kGather{10};

  // batch_size: maximum number of observations per request. gather: the pool waits up to this time for other
  // clients, or up to the duration of the last request if that is longer.
  PolicyPool(ClientOptions server, int batch_size, std::chrono::milliseconds gather = kGather);
  // Does not wait for the server's answer; pending clients receive none.
  ~PolicyPool();
  PolicyPool(const PolicyPool&) = delete;
  PolicyPool& operator=(const PolicyPool&) = delete;

  // Address for clients in processes on this machine, in any network namespace: ClientOptions::pool_url.
  const std::string& url() const { return url_; }

 private:
  struct State;

  std::string folder_, url_;
  std::shared_ptr<State> state_;
};

// Creates a client of the pool at options.pool_url, which applies the deadlines. Does not connect yet.
std::unique_ptr<PolicyClient> MakePoolClient(const ClientOptions& options);

}  // namespace evalbus::policy
