// Implements the part of models/scene.h that a sim with another version of MuJoCo needs (docs/engines.md).
// Compiled models can be read only by the version that wrote them, so this sim compiles the composed scene of
// the run again.
#include "models/scene.h"

#include <tinyxml2.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/run_layout.h"
#include "models/inferred_inertials.h"
#include "models/model_info.h"
#include "models/mujoco_errors.h"

namespace evalbus {
namespace {

// Version 2.3.3 and later versions have the integrator implicitfast. MuJoCo 2.2 does not, so the composed
// scene has implicit where RoboEval has implicitfast.
constexpr bool kHasImplicitFast = mjVERSION_HEADER >= 233;
// MuJoCo versions infer different volumes, and therefore different masses, from meshes that are not convex.
// Version 2.2 wrote the composed scene.
constexpr bool kInfersOtherVolumes = mjVERSION_HEADER / 10 != 22;

ModelPtr Compile(const tinyxml2::XMLDocument& document, const std::filesystem::path& file,
                 std::vector<std::string>* warnings) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  const VfsPtr vfs = MakeVfs();
  AddToVfs("scene.xml", printer.CStr(), vfs.get());
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
  throw InputError("this program only simulates scenes that 'evalbus run --engine' has composed");
}

Scene LoadScene(const TaskDescription& task, const RobotDescription& robot, const std::filesystem::path& run,
                const std::string&, const std::string&) {
  const std::filesystem::path file = run / kModelFolder / kSceneXml;
  tinyxml2::XMLDocument document;
  if (document.Parse(ReadInput(file, "composed scene").c_str()) != tinyxml2::XML_SUCCESS) {
    throw InputError(file.string() + ": not valid XML (" + document.ErrorName() + ")");
  }
  tinyxml2::XMLElement* root = document.RootElement();
  tinyxml2::XMLElement* option = root->FirstChildElement("option");
  if (const char* integrator = option->Attribute("integrator");
      kHasImplicitFast && integrator && std::string(integrator) == "implicit") {
    option->SetAttribute("integrator", "implicitfast");
  }
  tinyxml2::XMLElement* worldbody = root->FirstChildElement("worldbody");
  const bool infer = kInfersOtherVolumes && mjcf::RemoveInferredInertials(worldbody);

  Scene scene;
  scene.visual = Compile(document, file, &scene.warnings);
  if (infer) mjcf::AddInferredInertials(worldbody, *scene.visual);
  root->FirstChildElement("compiler")->SetAttribute("discardvisual", "true");
  scene.physics = Compile(document, file, &scene.warnings);
  scene.info = DescribeModel(task, robot, *scene.physics);
  return scene;
}

}  // namespace evalbus
