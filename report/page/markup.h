// Writes HTML with inline SVG that is also well-formed XML. All texts and attributes are escaped, and
// characters that XML does not allow are replaced (Printable in base/text.h). No content of a run's files can
// therefore become markup or make the page invalid.
#pragma once

#include <tinyxml2.h>

#include <concepts>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>

namespace evalbus::report {

class Markup {
 public:
  // Names and values of attributes.
  using Attributes = std::initializer_list<std::pair<const char*, std::string>>;

  Markup() : printer_(nullptr, true) {}

  // `name` must be a string literal, because it is not copied.
  void Open(const char* name, Attributes attributes = {});
  // Adds an attribute to the element that Open() has just opened.
  void Attribute(const char* name, const std::string& value);
  void Close();
  // Writes an element whose content is written by `content`.
  template <std::invocable Content>
  void Element(const char* name, Attributes attributes, Content content) {
    Open(name, attributes);
    content();
    Close();
  }
  void Element(const char* name, Attributes attributes, const std::string& text);
  // Writes an element without content, e.g. <meta/> or an SVG shape.
  void Empty(const char* name, Attributes attributes);
  void Text(const std::string& text);
  // Writes the content of <script> or <style> without escaping. Must only be used for evalbus' own code,
  // never for data of a run.
  void Verbatim(const std::string& code);
  void Doctype() { printer_.PushUnknown("DOCTYPE html"); }

  std::string str() const { return printer_.CStr(); }

 private:
  tinyxml2::XMLPrinter printer_;
};

// Returns a path as a URL relative to the page's folder. Every byte other than letters, digits and - . _ ~ /
// is percent-encoded.
std::string Url(const std::filesystem::path& relative);

}  // namespace evalbus::report
