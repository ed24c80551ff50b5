// A Value from a parser's events, within bounds that no bytes of a server talk us out of.
#pragma once

#include <string>
#include <vector>

#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

// Throws ServerError (kProtocol), whose text begins with the format's name, for more than 32 levels or a
// million values, and for a map that has a key twice. A reply has some dozens of values, four levels deep;
// one may take a hundred times its bytes in memory.
class TreeBuilder {
 public:
  explicit TreeBuilder(const char* format) : format_(format) {}

  // A list or a map begins.
  void Open(Value container);
  // Of the next value of the map that is open.
  void SetKey(std::string key) { open_.back().key = std::move(key); }
  void Add(Value value);
  void CloseList();
  // `meaning`: of Map to the Value that it stands for.
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
