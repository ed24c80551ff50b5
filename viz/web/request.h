// What a browser asks the web server for, and whether it may. Pure: text in, facts out; whatever the text is.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace evalbus::viz {

// What a target names.
struct WebTarget {
  enum class Kind { kNone, kPage, kPageFile, kBlock, kEpisode, kLive };
  Kind kind = Kind::kNone;
  // Of a file of the page ("scene.js"), or the id of a block: 64 hexadecimal digits.
  std::string name{};
  // Of kEpisode.
  int run = -1, episode = -1;
};

// The target of a request line: "/", "/page/NAME", "/block/ID", "/episode/RUN/EPISODE", "/live"; where there
// is a token, behind "/TOKEN". A query is ignored. Anything else is kNone: there are no folders and no "..".
WebTarget ParseTarget(std::string_view target, std::string_view token);

// The same text; takes as long wherever they differ.
bool SameText(std::string_view a, std::string_view b);

// True for a Host header that names this machine by its loopback, at any port (of a tunnel, say). A page that
// some name server brought here under a name of its own (DNS rebinding) says that name.
bool IsLoopbackHost(std::string_view host);

// True if a page from `origin` (a header; empty: none was sent) is one that the server at `host` has sent.
bool IsOwnOrigin(std::string_view origin, std::string_view host);

// {"watch": RUN}, all that a page ever says; nothing for any other text.
std::optional<int> ParseWatch(std::string_view message);

}  // namespace evalbus::viz
