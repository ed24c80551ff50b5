// Parses and authorizes requests of browsers to the web server. Pure; accepts arbitrary text.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace evalbus::viz {

// The resource that a request target names.
struct WebTarget {
  enum class Kind { kNone, kPage, kPageFile, kBlock, kEpisode, kLive };
  Kind kind = Kind::kNone;
  // kPageFile: name of the file ("scene.js"). kBlock: id of the block, 64 hexadecimal digits.
  std::string name{};
  // Only for kEpisode.
  int run = -1, episode = -1;
};

// Parses the target of a request line: "/", "/page/NAME", "/block/ID", "/episode/RUN/EPISODE", "/live";
// preceded by "/TOKEN" if there is a token. A query is ignored. Anything else is kNone: there are no folders
// and no "..".
WebTarget ParseTarget(std::string_view target, std::string_view token);

// Compares texts in a time that does not depend on where they differ.
bool SameText(std::string_view a, std::string_view b);

// Returns whether a Host header names the loopback interface of this machine, at any port (e.g. of a tunnel).
// A request sent by DNS rebinding carries the attacker's host name instead.
bool IsLoopbackHost(std::string_view host);

// Returns whether a page with this Origin header (empty: none was sent) was served by the server at `host`.
bool IsOwnOrigin(std::string_view origin, std::string_view host);

// The messages that a page sends: {"watch": RUN}; {"note": {"run": RUN, "episode": EPISODE, "text": TEXT}},
// which sets a user's note on an episode; {"verdict": {"episode": EPISODE, "outcome": OUTCOME, "stages":
// STAGES, "rubric": RUBRIC}}, which gives an operator's verdict. All return nothing for any other text.
std::optional<int> ParseWatch(std::string_view message);
struct WebNote {
  int run = -1, episode = -1;
  std::string text;
};
std::optional<WebNote> ParseNote(std::string_view message);
struct WebVerdict {
  int episode = -1;
  // "success", "failure" or "abstain".
  std::string outcome;
  // Number of stages reached, and a score from 0 to 10; null in the message if they are not given.
  std::optional<int> stages;
  std::optional<double> rubric;
};
std::optional<WebVerdict> ParseVerdict(std::string_view message);

}  // namespace evalbus::viz
