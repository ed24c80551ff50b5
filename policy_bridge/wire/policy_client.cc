#include "policy_bridge/wire/policy_client.h"

#include <sstream>

#include "base/text.h"
#include "policy_bridge/wire/clients.h"
#include "policy_bridge/wire/policy_pool.h"

namespace evalbus::policy {

namespace {

std::string Trimmed(const std::string& text) {
  constexpr const char* kSpaces = " \t\r\n";
  const size_t begin = text.find_first_not_of(kSpaces);
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(kSpaces) - begin + 1);
}

// Returns the type and the whole message of the exception in a Python traceback, whose lines are joined by ";
// ". For any other text, returns its last line.
std::string Summary(const std::string& text) {
  const size_t traceback = text.rfind("Traceback (most recent call last):");
  std::istringstream lines(traceback == std::string::npos ? text : text.substr(traceback));
  std::string summary, last;
  bool is_first = true;
  for (std::string line; std::getline(lines, line); is_first = false) {
    // Carriage returns separate the states of a progress bar.
    const std::string whole = Trimmed(line);
    const std::string trimmed = Trimmed(whole.substr(whole.rfind('\r') + 1));
    if (trimmed.empty()) continue;
    last = trimmed;
    // The frames of the traceback are indented.
    if (is_first || (summary.empty() && line.front() == ' ')) continue;
    summary += (summary.empty() ? "" : "; ") + trimmed;
  }
  return traceback == std::string::npos || summary.empty() ? last : summary;
}

}  // namespace

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
  const std::string summary = Summary(words);
  return {ServerError::Kind::kServer,
          summary.empty() ? "the server fails without a message"
                          : "the server reports: " + Printable(Cut(summary, 400)),
          words};
}

}  // namespace evalbus::policy
