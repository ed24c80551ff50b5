#include "report/page/markup.h"

#include <fmt/format.h>

#include <cctype>

#include "base/text.h"

namespace evalbus::report {

void Markup::Open(const char* name, Attributes attributes) {
  printer_.OpenElement(name, true);
  for (const auto& [key, value] : attributes) Attribute(key, value);
}

void Markup::Attribute(const char* name, const std::string& value) {
  printer_.PushAttribute(name, Printable(value).c_str());
}

void Markup::Close() {
  // An HTML parser treats <td/> as an open tag. Pushing an empty text produces <td></td> instead.
  printer_.PushText("");
  printer_.CloseElement(true);
}

void Markup::Element(const char* name, Attributes attributes, const std::string& text) {
  Open(name, attributes);
  Text(text);
  Close();
}

void Markup::Empty(const char* name, Attributes attributes) {
  Open(name, attributes);
  printer_.CloseElement(true);
}

void Markup::Text(const std::string& text) { printer_.PushText(Printable(text).c_str()); }

void Markup::Verbatim(const std::string& code) {
  // An XML parser reads the result as a CDATA section. An HTML parser sees the code between two comments.
  printer_.PushText("/*");
  printer_.PushText(("*/\n" + code + "/*").c_str(), true);
  printer_.PushText("*/");
}

std::string Url(const std::filesystem::path& relative) {
  std::string url;
  for (const char c : relative.generic_string()) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        byte < 0x80 && (std::isalnum(byte) || c == '-' || c == '.' || c == '_' || c == '~' || c == '/');
    url += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return url;
}

}  // namespace evalbus::report
