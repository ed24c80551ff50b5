// Mutations that libFuzzer lacks: of lines, of numbers in text, and replacements of one piece of text by
// another.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace evalbus {

// Mutates a text or bytes once; equal seeds give equal mutations.
inline std::string Mutate(std::string text, uint32_t seed) {
  std::minstd_rand random(seed);
  random.discard(2);
  const auto index = [&](size_t count) { return count == 0 ? 0 : random() % count; };
  // Returns the start of the next line.
  const auto line = [&](size_t from) {
    const size_t begin = text.find('\n', from);
    return begin == std::string::npos ? text.size() : begin + 1;
  };
  const size_t begin = line(index(text.size() + 1)), length = line(begin) - begin;
  const size_t place = index(text.size());
  switch (random() % 7) {
    case 0:
      return text.erase(begin, length);
    case 1:
      return text.insert(line(place), text.substr(begin, length));
    case 2: {
      const std::string moved = text.substr(begin, length);
      text.erase(begin, length);
      return text.insert(line(index(text.size() + 1)), moved);
    }
    case 3: {
      constexpr const char* kNumbers[] = {"0",          "-1",          "1e308", "-1e308",  "1e-308",
                                          "2147483647", "-2147483648", "0.5",   "1e18",    "null",
                                          "true",       "[]",          "{}",    "\"\xFF\""};
      const size_t number = std::min(text.find_first_of("0123456789", place), text.size());
      const size_t behind = std::min(text.find_first_not_of("-+.e0123456789", number), text.size());
      return text.replace(number, behind - number, kNumbers[index(std::size(kNumbers))]);
    }
    case 4:
      return text.erase(place, 1 + index(8));
    case 5:
      return text.insert(place, text.substr(index(text.size()), 1 + index(16)));
    default:
      if (!text.empty()) text[place] = static_cast<char>(random());
      return text;
  }
}

}  // namespace evalbus
