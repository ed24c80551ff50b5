// A server double and the client of one wire, for the tests of WebSocket wires.
#pragma once

#include <memory>
#include <utility>

#include "policy_bridge/wire/policy_client.h"
#include "tests/doubles/policy_server.h"

namespace evalbus::policy {

// Returns options of a server that gives the same answer to every request.
inline PolicyServerDouble::Options AlwaysAnswering(Wire wire, PolicyServerDouble::Answer answer) {
  PolicyServerDouble::Options options;
  options.wire = wire;
  options.answer = [answer = std::move(answer)](const Value&) { return answer; };
  return options;
}

inline std::unique_ptr<PolicyClient> ClientOfWire(Wire wire, const PolicyServerDouble& server,
                                                  double connect_s, double first_reply_s) {
  ClientOptions options;
  options.wire = wire;
  options.url = server.url();
  options.connect_s = connect_s;
  options.first_reply_s = first_reply_s;
  return MakePolicyClient(options);
}

}  // namespace evalbus::policy
