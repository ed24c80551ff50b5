// Part of models/scene.h in a sim of another version of MuJoCo (docs/engines.md). Model files can be read
// only by the version that wrote them, so this sim compiles the composed scene of the run again.
#include "models/scene.h"

#include <tinyxml2.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/run_layout.h"
#include "models/model_info.h"
#include "models/mujoco_errors.h"

namespace evalbus {
namespace {

// MuJoCo 2.2 has no implicitfast, so the composed scene has implicit where RoboEval has implicitfast.
constexpr bool kHasImplicitFast = mjVERSION_HEADER >= 233;

std::string XmlFor(const std::filesystem::path& file, bool discard_visual) {
  tinyxml2::XMLDocument document;
  if (document.Parse(ReadInput(file, "composed scene").c_str()) != tinyxml2::XML_SUCCESS) {
    throw InputError(file.string() + ": not valid XML (" + document.ErrorName() + ")");
  }
  tinyxml2::XMLElement* root = document.RootElement();
  if (discard_visual) root->FirstChildElement("compiler")->SetAttribute("discardvisual", "true");
  tinyxml2::XMLElement* option = root->FirstChildElement("option");
  if (const char* integrator = option->Attribute("integrator");
      kHasImplicitFast && integrator && std::string(integrator) == "implicit") {
    option->SetAttribute("integrator", "implicitfast");
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

ModelPtr Compile(const std::filesystem::path& file, bool discard_visual, std::vector<std::string>* warnings) {
  const VfsPtr vfs = MakeVfs();
  AddToVfs("scene.xml", XmlFor(file, discard_visual), vfs.get());
  const MujocoCompileGuard guard(warnings);
  char message[2000] = "";
  ModelPtr model(mj_loadXML("scene.xml", vfs.get(), message, sizeof(message)));
  const std::string words = file.string() + ": MuJoCo " + mj_versionString() + ": " + OneLine(message);
  if (!model) throw InputError(words);
  if (*message) warnings->push_back(words);
  return model;
}

}  // namespace

Scene BuildScene(const TaskDescription&, const RobotDescription&) {
  throw InputError("this program simulates scenes that 'evalbus run --engine' has composed");
}

Scene LoadScene(const TaskDescription& task, const RobotDescription& robot, const std::filesystem::path& run,
                const std::string&, const std::string&) {
  const std::filesystem::path file = run / kModelFolder / kSceneXml;
  Scene scene;
  scene.physics = Compile(file, true, &scene.warnings);
  scene.visual = Compile(file, false, &scene.warnings);
  scene.info = DescribeModel(task, robot, *scene.physics);
  return scene;
}

}  // namespace evalbus
