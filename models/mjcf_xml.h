// Functions for reading and writing the XML elements of MJCF.
#pragma once

#include <tinyxml2.h>

#include <string>
#include <vector>

namespace evalbus::mjcf {

// Throws InputError "file:line: message" with the element's source.
[[noreturn]] void Fail(const tinyxml2::XMLElement* element, const std::string& message);

// Returns the element's tag as shown in messages, such as "<geom>".
std::string Tag(const tinyxml2::XMLElement* element);
bool Is(const tinyxml2::XMLElement* element, const char* name);

std::string Get(const tinyxml2::XMLElement* element, const char* attribute,
                const std::string& otherwise = "");
void Set(tinyxml2::XMLElement* element, const char* attribute, const std::string& value);

// Returns a copy, so that children can be deleted or moved during iteration.
std::vector<tinyxml2::XMLElement*> Children(tinyxml2::XMLElement* element);

// Calls visit(element) for the element and all its descendants, parents first.
template <typename Visit>
void ForEach(tinyxml2::XMLElement* element, const Visit& visit) {
  visit(element);
  for (tinyxml2::XMLElement* child : Children(element)) ForEach(child, visit);
}

// Returns the shortest text that parses to the same number.
std::string NumberText(double value);

// Formats numbers with NumberText(), separated by spaces.
template <typename Numbers>
std::string Join(const Numbers& numbers) {
  std::string text;
  for (double number : numbers) {
    if (!text.empty()) text += ' ';
    text += NumberText(number);
  }
  return text;
}

// Parses the numbers in an attribute's text. count: required number of values; 0: any. Throws InputError.
std::vector<double> ParseNumbers(const tinyxml2::XMLElement* element, const char* attribute,
                                 const std::string& text, size_t count);

}  // namespace evalbus::mjcf
