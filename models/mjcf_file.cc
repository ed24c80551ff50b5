#include "models/mjcf_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "base/file_errors.h"
#include "models/source_location.h"

namespace evalbus {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

// Throws InputError for numbers that MuJoCo accepts although they have no physical meaning. MuJoCo treats an
// attribute that is NaN as absent, so that a mass of NaN becomes volume times density.
void CheckNumbers(const XMLElement& element) {
  for (const char* name :
       {"mass", "density", "friction", "diaginertia", "fullinertia", "damping", "stiffness", "armature",
        "frictionloss", "size", "pos", "quat", "gear", "kp", "gravity"}) {
    const char* text = element.Attribute(name);
    std::istringstream words(text ? text : "");
    for (std::string word; words >> word;) {
      char* end = nullptr;
      const double number = std::strtod(word.c_str(), &end);
      if (*end != 0) continue;  // reported by MuJoCo
      const bool is_friction = std::string_view(name) == "friction";
      if (std::isfinite(number) && !(is_friction && number < 0)) continue;
      throw InputError(SourceOf(&element) + ": attribute '" + name + "': expected " +
                       (is_friction ? "finite numbers of at least 0" : "finite numbers") + ", got '" + word +
                       "'");
    }
  }
}

void TagSources(XMLElement* element, const std::string& file) {
  element->SetAttribute(kSourceAttribute, (file + ":" + std::to_string(element->GetLineNum())).c_str());
  CheckNumbers(*element);
  for (XMLElement* child = element->FirstChildElement(); child; child = child->NextSiblingElement()) {
    TagSources(child, file);
  }
}

std::unique_ptr<XMLDocument> Load(const std::filesystem::path& file, const std::string& asked_by) {
  const std::string prefix = asked_by.empty() ? "" : asked_by + ": ";
  if (!std::filesystem::is_regular_file(file)) {
    throw InputError(OneLine(prefix + "model file " + file.string() + " does not exist"));
  }
  auto document = std::make_unique<XMLDocument>();
  const tinyxml2::XMLError error = document->LoadFile(file.c_str());
  if (error == tinyxml2::XML_ERROR_FILE_NOT_FOUND || error == tinyxml2::XML_ERROR_FILE_COULD_NOT_BE_OPENED) {
    ThrowFileError(file.string() + ": cannot be read", errno);
  }
  if (error != tinyxml2::XML_SUCCESS) {
    const std::string what =
        error == tinyxml2::XML_ERROR_EMPTY_DOCUMENT ? "the file is empty"
        : error == tinyxml2::XML_ERROR_MISMATCHED_ELEMENT
            ? "the element that begins here is not closed, or closed by the end of another element"
            : document->ErrorName();
    throw InputError(file.string() + ":" + std::to_string(std::max(1, document->ErrorLineNum())) +
                     ": not valid XML (" + what + ")");
  }
  XMLElement* root = document->RootElement();
  if (!root) throw InputError(file.string() + ":1: expected an MJCF model (<mujoco>)");
  TagSources(root, file.string());
  const std::string name = root->Name();
  if (name != "mujoco" && !(name == "mujocoinclude" && !asked_by.empty())) {
    throw InputError(SourceOf(root) + ": expected an MJCF model (<mujoco>), got <" + name + ">");
  }
  return document;
}

// Replaces each <include> below `parent` by the contents of its file. As in MuJoCo, paths are relative to the
// folder of the main file. `open` contains the files that are being included.
void ExpandIncludes(XMLElement* parent, const std::filesystem::path& folder,
                    std::vector<std::filesystem::path>* open) {
  for (XMLElement* child = parent->FirstChildElement(); child;) {
    XMLElement* next = child->NextSiblingElement();
    if (std::string(child->Name()) == "include") {
      const char* name = child->Attribute("file");
      if (!name) throw InputError(SourceOf(child) + ": <include> requires the attribute 'file'");
      const std::filesystem::path file = (folder / name).lexically_normal();
      for (const auto& other : *open) {
        if (other == file) throw InputError(SourceOf(child) + ": " + file.string() + " includes itself");
      }
      const auto document = Load(file, SourceOf(child));
      open->push_back(file);
      ExpandIncludes(document->RootElement(), folder, open);
      open->pop_back();
      XMLNode* last = child;
      for (XMLNode* node = document->RootElement()->FirstChild(); node; node = node->NextSibling()) {
        last = parent->InsertAfterChild(last, node->DeepClone(parent->GetDocument()));
      }
      parent->DeleteChild(child);
    } else {
      ExpandIncludes(child, folder, open);
    }
    child = next;
  }
}

void CollectNames(const XMLElement* element, const std::string& kind, std::set<std::string>* names) {
  for (const XMLElement* child = element->FirstChildElement(); child; child = child->NextSiblingElement()) {
    const char* name = child->Attribute("name");
    if (name && (kind == "*" || kind == child->Name())) names->insert(name);
    CollectNames(child, kind, names);
  }
}

}  // namespace

MjcfFile ReadMjcf(const std::filesystem::path& file) {
  MjcfFile mjcf;
  mjcf.file = std::filesystem::absolute(file).lexically_normal();
  mjcf.document = Load(mjcf.file, "");
  mjcf.root = mjcf.document->RootElement();
  std::vector<std::filesystem::path> open{mjcf.file};
  ExpandIncludes(mjcf.root, mjcf.file.parent_path(), &open);
  return mjcf;
}

std::string SourceOf(const XMLElement* element) {
  const char* source = element->Attribute(kSourceAttribute);
  return source ? source : "?";
}

std::set<std::string> NamesIn(const MjcfFile& mjcf, const std::string& section, const std::string& kind) {
  std::set<std::string> names;
  for (const XMLElement* child = mjcf.root->FirstChildElement(section.c_str()); child;
       child = child->NextSiblingElement(section.c_str())) {
    CollectNames(child, kind, &names);
  }
  return names;
}

}  // namespace evalbus
