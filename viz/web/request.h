// Parses and authorizes requests of browsers to the web server. Pure. All functions accept arbitrary text.
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
  // Set only for kEpisode.
  int run = -1, episode = -1;
};

// Parses the target of a request line: "/", "/page/NAME", "/block/ID", "/episode/RUN/EPISODE" or "/live",
// preceded by "/TOKEN" if there is a token. A query is ignored. Any other target, such as one with folders or
// "..", is kNone.
WebTarget ParseTarget(std::string_view target, std::string_view token);

// Compares two strings. The time that this takes does not depend on where they differ.
bool SameText(std::string_view a, std::string_view b);

// Returns whether a Host header names the loopback interface of this machine, at any port (e.g. the port of a
// tunnel). A request sent by DNS rebinding contains the attacker's host name instead.
bool IsLoopbackHost(std::string_view host);

// Returns whether the page that sent this Origin header was served by the server at `host`. origin: empty if
// no header was sent; the result is then true, because browsers send one.
bool IsOwnOrigin(std::string_view origin, std::string_view host);

// Parse the messages that a page sends. The functions return nullopt for any other text.
// - {"watch": RUN}: the run that the viewer watches.
// - {"note": {"run": RUN, "episode": EPISODE, "text": TEXT}}: a user's note on an episode.
// - {"verdict": {"episode": EPISODE, "outcome": OUTCOME, "stages": STAGES, "rubric": RUBRIC}}: an operator's
//   verdict.
std::optional<int> ParseWatch(std::string_view message);
struct WebNote {
  int run = -1, episode = -1;
  std::string text;
};
std::optional<WebNote> ParseNote(std::string_view message);
struct WebVerdict {
  int episode = -1;
  // The operator's verdict: "success", "failure" or "abstain".
  std::string outcome;
  // Number of stages that were reached, and a score from 0 to 10. In the message, null stands for a value
  // that the operator did not give.
  std::optional<int> stages;
  std::optional<double> rubric;
};
std::optional<WebVerdict> ParseVerdict(std::string_view message);

}  // namespace evalbus::viz
