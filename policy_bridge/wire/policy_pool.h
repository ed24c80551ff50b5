// Several processes that ask one policy server as one client: what waits together is one request. For servers
// whose requests have a batch, and which keep nothing of an episode: beginning one is not passed on, since
// that would concern all.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// Speaks to the server, in a thread. What came while the server was busy is asked together. Before that it
// waits for those who will ask soon, who have connected or were answered in one of the last two requests:
// else two clients that come in turns would be asked for in turns for ever. It waits no longer than the last
// request took (1 s at most), so that waiting costs no more than asking apart.
//
// An answer depends on its own observation alone: where a server says that it failed, it is asked the
// observations of the batch one by one, and who asked gets its own. A server that is gone or late concerns
// those of the batch; the next ones connect again.
class PolicyPool {
 public:
  static constexpr std::chrono::milliseconds kGather{10};

  // batch_size: observations of a request, at most. gather: it waits so long in any case.
  PolicyPool(ClientOptions server, int batch_size, std::chrono::milliseconds gather = kGather);
  // Does not wait for the server's answer. Who asks then gets none.
  ~PolicyPool();
  PolicyPool(const PolicyPool&) = delete;
  PolicyPool& operator=(const PolicyPool&) = delete;

  // Where clients of processes on this machine connect, whatever network they are in:
  // ClientOptions::pool_url.
  const std::string& url() const { return url_; }

 private:
  struct State;

  std::string folder_, url_;
  std::shared_ptr<State> state_;
};

// Asks the pool at options.pool_url, which keeps the deadlines. Does not connect yet.
std::unique_ptr<PolicyClient> MakePoolClient(const ClientOptions& options);

}  // namespace evalbus::policy
