// Builds a Value from a parser's events, with limits that protect against malicious or faulty servers.
#pragma once

#include <string>
#include <vector>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Throws ServerError (kProtocol), with a text that begins with the format's name, for more than 32 levels,
// more than a million values, or a map that contains a key twice. A typical reply has a few dozen values on
// four levels. The limits are necessary, because a value may need a hundred times its encoded size in memory.
//
// The functions that handle an event return true, so that the parsers continue.
class TreeBuilder {
 public:
  explicit TreeBuilder(const char* format) : format_(format) {}

  // Opens a list or a map.
  bool Open(Value container);
  // Sets the key of the next value of the open map.
  bool SetKey(std::string key) {
    open_.back().key = std::move(key);
    return true;
  }
  bool Add(Value value);
  bool CloseList() { return Close(std::move(open_.back().value)); }
  // Closes the open map, and replaces it by meaning(map): the value that the map represents.
  template <class Meaning>
  bool CloseMap(const Meaning& meaning) {
    CheckKeys(*open_.back().value.As<Map>());
    return Close(meaning(std::move(*open_.back().value.As<Map>())));
  }

  Value Take() { return std::move(whole_); }

 private:
  struct Opened {
    Value value;
    std::string key;
  };

  bool Close(Value value);
  void CheckKeys(const Map& map) const;
  [[noreturn]] void Refuse(const std::string& what) const;

  const char* format_;
  std::vector<Opened> open_;
  size_t num_values_ = 0;
  Value whole_;
};

}  // namespace evalbus::policy
