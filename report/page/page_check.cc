#include "report/page/page_check.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/errors.h"
#include "base/json_file.h"
#include "report/page/page.h"

namespace evalbus::report {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

template <size_t kSize>
bool IsOneOf(std::string_view word, const std::array<std::string_view, kSize>& words) {
  return std::ranges::find(words, word) != words.end();
}

constexpr std::array<std::string_view, 6> kUncheckedElements = {"head",  "script", "style",
                                                                "video", "img",    "footer"};
constexpr std::array<std::string_view, 4> kHeadings = {"h1", "h2", "h3", "h4"};
// Attributes that differ if an episode cannot be played or a file is missing: a <span> then replaces the <a>
// or <button>.
constexpr std::array<std::string_view, 6> kUncheckedAttributes = {"href",      "tabindex", "id",
                                                                  "data-seek", "type",     "open"};

bool IsUnchecked(const XMLElement& element) {
  const char* const css_class = element.Attribute("class");
  return IsOneOf(element.Name(), kUncheckedElements) || element.Attribute(kUnchecked) ||
         (css_class && std::string_view(css_class) == "in-3d");
}

// Returns the text without spaces at its ends.
std::string Trimmed(const std::string& text) {
  constexpr const char* kSpace = " \n\t";
  const size_t first = text.find_first_not_of(kSpace);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::string TextOf(const XMLNode& node) {
  std::string text;
  for (const XMLNode* child = node.FirstChild(); child; child = child->NextSibling()) {
    if (child->ToText()) text += child->Value();
    text += TextOf(*child);
  }
  return text;
}

class Reader {
 public:
  explicit Reader(PageContent* content) : content_(*content) {}

  void Read(const XMLElement& element) {
    if (IsUnchecked(element)) return;
    if (IsOneOf(element.Name(), kHeadings)) {
      heading_ = Trimmed(TextOf(element));
      row_.clear();
    }
    if (element.Attribute("scope", "row")) row_ = Trimmed(TextOf(element));
    ReadAttributes(element);
    for (const XMLNode* child = element.FirstChild(); child; child = child->NextSibling()) {
      if (child->ToElement()) Read(*child->ToElement());
      if (child->ToText()) Add(Trimmed(child->Value()));
    }
  }

 private:
  void ReadAttributes(const XMLElement& element) {
    const std::string_view name = element.Name();
    // Attributes of buttons and of links without a class do not show results.
    if (name == "button" || (name == "a" && !element.Attribute("class"))) return;
    for (const auto* a = element.FirstAttribute(); a; a = a->Next()) {
      const std::string_view value = a->Value();
      const bool depends_on_video =
          std::string_view(a->Name()) == "class" && (value == "beside" || value == "time");
      if (value.empty() || depends_on_video || IsOneOf(a->Name(), kUncheckedAttributes)) continue;
      Add(fmt::format("{}=\"{}\"", a->Name(), value));
    }
  }
  void Add(const std::string& text) {
    if (text.empty()) return;
    content_.items.push_back({text, heading_ + (row_.empty() || row_ == heading_ ? "" : ", " + row_)});
  }

  PageContent& content_;
  // Latest heading and row label, which describe the place of an item.
  std::string heading_, row_;
};

const XMLElement* Child(const XMLElement* element, const char* name) {
  return element ? element->FirstChildElement(name) : nullptr;
}

}  // namespace

std::string RelativeToPage(const fs::path& folder, const fs::path& page) {
  if (folder.empty()) return "";
  return fs::relative(fs::absolute(folder), fs::absolute(page).parent_path()).generic_string();
}

PageContent ReadPage(const std::string& html, const std::string& file) {
  tinyxml2::XMLDocument document;
  if (document.Parse(html.data(), html.size()) != tinyxml2::XML_SUCCESS)
    throw InputError(fmt::format("{}:{}: not a well-formed page", file, document.ErrorLineNum()));
  PageContent content;
  const XMLElement* const root = document.RootElement();
  for (const XMLElement* meta = Child(Child(root, "head"), "meta"); meta;
       meta = meta->NextSiblingElement("meta")) {
    if (meta->Attribute("name", kSourceMeta) && meta->Attribute("content"))
      content.source = ParseJson<nlohmann::ordered_json>(meta->Attribute("content"), file);
  }
  if (const XMLElement* const footer = Child(Child(root, "body"), "footer")) {
    const std::string text = TextOf(*footer);
    if (text.starts_with(kMadeBy) && text.ends_with('.'))
      content.made_by =
          text.substr(std::string_view(kMadeBy).size(), text.size() - std::string_view(kMadeBy).size() - 1);
  }
  Reader(&content).Read(*root);
  return content;
}

std::optional<std::string> FirstDifference(const PageContent& stored, const PageContent& computed) {
  const auto [a, b] = std::ranges::mismatch(stored.items, computed.items, {}, &PageContent::Item::text,
                                            &PageContent::Item::text);
  const bool has_a = a != stored.items.end(), has_b = b != computed.items.end();
  if (!has_a && !has_b) return std::nullopt;
  const auto text = [](bool has, const auto& item) {
    return has ? "'" + item->text + "'" : std::string("nothing");
  };
  return fmt::format("{} under '{}', recomputed {}", text(has_a, a), has_a ? a->where : b->where,
                     text(has_b, b));
}

}  // namespace evalbus::report
