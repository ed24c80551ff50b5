// Lets several processes query a policy server as one client. Pending observations are combined into one
// request. The server must support batches and keep no state during an episode. The beginning of an episode
// is not reported to the server, because it would affect all clients.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Queries the server on a separate thread. Observations that arrive while the server is busy form the next
// batch. Before a request, the pool also waits for the clients that are expected to send soon: clients that
// connected, or received an answer, during the last two requests. Otherwise two clients that happen to
// alternate would never share a batch. The pool waits at most as long as the last request took, up to 1 s (or
// `gather`, if that is longer). This wait therefore delays a pending observation by no more than the duration
// of one request (or by `gather`).
//
// An answer depends only on its own observation. If the server reports a failure, the observations of the
// batch are sent again one by one, and each client receives its own result. If the connection is lost or a
// deadline passes, all clients of the batch receive this error, and the pool reconnects for the next batch.
class PolicyPool {
 public:
  static constexpr std::chrono::milliseconds kGather{10};

  // batch_size: maximum number of observations per request. gather: the pool waits up to this time for other
  // clients, or up to the duration of the last request if that is longer.
  PolicyPool(ClientOptions server, int batch_size, std::chrono::milliseconds gather = kGather);
  // Does not wait for the server's answer, so pending clients receive no answer.
  ~PolicyPool();
  PolicyPool(const PolicyPool&) = delete;
  PolicyPool& operator=(const PolicyPool&) = delete;

  // Address of the pool (ClientOptions::pool_url), for clients on this machine in any network namespace.
  const std::string& url() const { return url_; }

 private:
  struct State;

  std::string folder_, url_;
  std::shared_ptr<State> state_;
};

// Creates a client of the pool at options.pool_url, which is not connected yet. The pool applies the
// deadlines.
std::unique_ptr<PolicyClient> MakePoolClient(const ClientOptions& options);

}  // namespace evalbus::policy
