#include "models/inferred_inertials.h"

#include <string>
#include <vector>

#include "models/mjcf_file.h"
#include "models/mjcf_xml.h"

namespace evalbus::mjcf {
namespace {

using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

// The elements are marked by a comment before them, because MuJoCo refuses unknown attributes.
constexpr const char* kMark = " inferred from geoms ";

bool IsMark(const XMLNode* node) { return node && node->ToComment() && node->Value() == std::string(kMark); }

}  // namespace

void AddInferredInertials(XMLElement* worldbody, const mjModel& model) {
  // Body ids follow document order, beginning with the world.
  int id = -1;
  ForEach(worldbody, [&](XMLElement* element) {
    if (!Is(element, "body") && !Is(element, "worldbody")) return;
    ++id;
    if (id == 0 || model.body_mass[id] == 0 || element->FirstChildElement("inertial")) return;
    const auto numbers = [id](const mjtNum* values, int n) {
      return Join(std::vector<double>(values + n * id, values + n * (id + 1)));
    };
    XMLElement* inertial = element->GetDocument()->NewElement("inertial");
    element->InsertFirstChild(inertial);
    element->InsertFirstChild(element->GetDocument()->NewComment(kMark));
    if (const char* source = element->Attribute(kSourceAttribute)) Set(inertial, kSourceAttribute, source);
    Set(inertial, "mass", NumberText(model.body_mass[id]));
    Set(inertial, "pos", numbers(model.body_ipos, 3));
    Set(inertial, "quat", numbers(model.body_iquat, 4));
    Set(inertial, "diaginertia", numbers(model.body_inertia, 3));
  });
}

bool RemoveInferredInertials(XMLElement* worldbody) {
  bool removed = false;
  ForEach(worldbody, [&removed](XMLElement* element) {
    if (!Is(element, "body") || !IsMark(element->FirstChild())) return;
    element->DeleteChild(element->FirstChildElement("inertial"));
    element->DeleteChild(element->FirstChild());
    removed = true;
  });
  return removed;
}

}  // namespace evalbus::mjcf
