// Writes HTML with inline SVG that is well-formed XML at the same time. Every text and every attribute is
// escaped, and of characters that XML has no place for (base/text.h, Printable) made one it has, so that
// nothing in a file of a run can become markup or spoil it.
#pragma once

#include <tinyxml2.h>

#include <concepts>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>

namespace evalbus::viz {

class Markup {
 public:
  // Names and values.
  using Attributes = std::initializer_list<std::pair<const char*, std::string>>;

  Markup() : printer_(nullptr, true) {}

  // Element names have to be literals.
  void Open(const char* name, Attributes attributes = {});
  void Close();
  // An element with what `content` writes.
  template <std::invocable Content>
  void Element(const char* name, Attributes attributes, Content content) {
    Open(name, attributes);
    content();
    Close();
  }
  void Element(const char* name, Attributes attributes, const std::string& text);
  // An element that never has content: <meta/>, or one of SVG.
  void Empty(const char* name, Attributes attributes);
  void Text(const std::string& text);
  // The text of <script> and <style>, as it is: our own, never a run's.
  void Verbatim(const std::string& code);
  void Doctype() { printer_.PushUnknown("DOCTYPE html"); }

  std::string str() const { return printer_.CStr(); }

 private:
  tinyxml2::XMLPrinter printer_;
};

// A path as a URL relative to the folder of the page: every byte that is no letter, digit, - . _ ~ or / is
// written as %XX.
std::string Url(const std::filesystem::path& relative);

}  // namespace evalbus::viz
