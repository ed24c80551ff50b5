// Describes how an exchange with a policy server fails.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "policy_bridge/wire/policy_client.h"
#include "tests/unit/policy_bridge/wire/hex.h"

namespace evalbus::policy {

// Returns the ServerError that `talk` throws. Its message must be one line.
template <class Talk>
ServerError FailureOf(const Talk& talk) {
  try {
    talk();
  } catch (const ServerError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error;
  }
  ADD_FAILURE() << "nothing failed";
  return {ServerError::Kind::kReply, "nothing failed"};
}

MATCHER_P2(FailsAs, kind, words, "") {
  *result_listener << "kind " << static_cast<int>(arg.kind()) << ": " << arg.what();
  return arg.kind() == kind && std::string_view(arg.what()).find(words) != std::string_view::npos;
}

// Returns the answer to a client whose time limit is so short that a loaded machine may need several
// attempts.
inline Value CallUntilInTime(PolicyClient* client, const Value& observation) {
  while (true) {
    try {
      if (!client->connected()) client->Connect();
      return client->Infer(observation).value;
    } catch (const ServerError& error) {
      if (error.kind() != ServerError::Kind::kTimeout) throw;
    }
  }
}

}  // namespace evalbus::policy
