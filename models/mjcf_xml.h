// MJCF as XML elements: small helpers for the code that checks and composes it.
#pragma once

#include <tinyxml2.h>

#include <string>
#include <vector>

namespace evalbus::mjcf {

// Throws InputError "file:line: message" with the place that the element comes from.
[[noreturn]] void Fail(const tinyxml2::XMLElement* element, const std::string& message);

// "<geom>"
std::string Tag(const tinyxml2::XMLElement* element);
bool Is(const tinyxml2::XMLElement* element, const char* name);

std::string Get(const tinyxml2::XMLElement* element, const char* attribute,
                const std::string& otherwise = "");
void Set(tinyxml2::XMLElement* element, const char* attribute, const std::string& value);

// A copy, so that children can be deleted or moved meanwhile.
std::vector<tinyxml2::XMLElement*> Children(tinyxml2::XMLElement* element);

// Calls visit(element) for the element and all below it, parents first.
template <typename Visit>
void ForEach(tinyxml2::XMLElement* element, const Visit& visit) {
  visit(element);
  for (tinyxml2::XMLElement* child : Children(element)) ForEach(child, visit);
}

// Shortest text that reads back as the same number.
std::string NumberText(double value);

// Such texts, with spaces between them.
template <typename Numbers>
std::string Join(const Numbers& numbers) {
  std::string text;
  for (double number : numbers) {
    if (!text.empty()) text += ' ';
    text += NumberText(number);
  }
  return text;
}

// The numbers that the attribute's text holds; count 0: any number of them. Throws InputError.
std::vector<double> ParseNumbers(const tinyxml2::XMLElement* element, const char* attribute,
                                 const std::string& text, size_t count);

}  // namespace evalbus::mjcf
