#include "policy_bridge/wire/server_words.h"

#include "base/text.h"

namespace evalbus::policy {

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
