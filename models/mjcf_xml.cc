#include "models/mjcf_xml.h"

#include <array>
#include <charconv>
#include <sstream>

#include "base/errors.h"
#include "models/mjcf_file.h"
#include "models/source_location.h"

namespace evalbus::mjcf {

using tinyxml2::XMLElement;

void Fail(const XMLElement* element, const std::string& message) {
  throw InputError(OneLine(SourceOf(element) + ": " + message));
}

std::string Tag(const XMLElement* element) { return "<" + std::string(element->Name()) + ">"; }

bool Is(const XMLElement* element, const char* name) { return std::string(element->Name()) == name; }

std::string Get(const XMLElement* element, const char* attribute, const std::string& otherwise) {
  const char* value = element->Attribute(attribute);
  return value ? value : otherwise;
}

void Set(XMLElement* element, const char* attribute, const std::string& value) {
  element->SetAttribute(attribute, value.c_str());
}

std::vector<XMLElement*> Children(XMLElement* element) {
  std::vector<XMLElement*> children;
  for (XMLElement* child = element->FirstChildElement(); child; child = child->NextSiblingElement()) {
    children.push_back(child);
  }
  return children;
}

std::string NumberText(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return std::string(text.data(), result.ptr);
}

std::vector<double> ParseNumbers(const XMLElement* element, const char* attribute, const std::string& text,
                                 size_t count) {
  std::vector<double> numbers;
  std::istringstream stream(text);
  double number = 0;
  while (stream >> number) numbers.push_back(number);
  if (!stream.eof() || (count != 0 && numbers.size() != count)) {
    Fail(element, Tag(element) + ": attribute '" + attribute + "': expected " +
                      (count != 0 ? std::to_string(count) + " " : "") + "numbers, got '" + text + "'");
  }
  return numbers;
}

}  // namespace evalbus::mjcf
