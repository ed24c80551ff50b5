// How talk with a policy server ends, and bytes as hexadecimal text.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {

// The ServerError that `talk` throws; its message has to be one line.
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

inline Bytes FromHex(std::string_view hex) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16)));
  }
  return bytes;
}

inline std::string ToHex(const Bytes& bytes) {
  std::string hex;
  for (const uint8_t byte : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    hex += {kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return hex;
}

}  // namespace evalbus::policy
