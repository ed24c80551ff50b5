// Builds a Value from a parser's events, with limits that protect against malicious or faulty servers.
#pragma once

#include <string>
#include <vector>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Throws ServerError (kProtocol), with a text that begins with the format's name, for more than 32 levels,
// more than a million values, or a map that contains a key twice. A typical reply has a few dozen values on
// four levels. The limits are necessary, because a value may need a hundred times its encoded size in memory.
class TreeBuilder {
 public:
  explicit TreeBuilder(const char* format) : format_(format) {}

  // Opens a list or a map.
  void Open(Value container);
  // Sets the key of the next value of the open map.
  void SetKey(std::string key) { open_.back().key = std::move(key); }
  void Add(Value value);
  void CloseList();
  // Closes the open map, and replaces it by meaning(map): the value that the map represents.
  template <class Meaning>
  void CloseMap(const Meaning& meaning) {
    CheckKeys(*open_.back().value.As<Map>());
    Close(meaning(std::move(*open_.back().value.As<Map>())));
  }

  Value Take() { return std::move(whole_); }

 private:
  struct Opened {
    Value value;
    std::string key;
  };

  void Close(Value value);
  void CheckKeys(const Map& map) const;
  [[noreturn]] void Refuse(const std::string& what) const;

  const char* format_;
  std::vector<Opened> open_;
  size_t num_values_ = 0;
  Value whole_;
};

}  // namespace evalbus::policy
