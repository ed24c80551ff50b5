#include "models/compile_model.h"

#include <regex>

#include "base/errors.h"
#include "models/mujoco_errors.h"
#include "models/polyhedron_contacts.h"

namespace evalbus {
namespace {

// Converts MuJoCo's message to one line. Replaces the line number in the composed document by file and line
// of the source of that line.
std::string Translate(std::string message, const SceneComposer& composer, bool discard_visual) {
  std::string source;
  std::smatch match;
  if (std::regex_search(message, match, std::regex(R"(line =? ?(\d+))")))
    source = composer.Locate(std::stoi(match[1]), discard_visual);
  // "Object name = pot/pot, id = 3, line = 40, column = -1", "Element 'geom', line 40"
  message = std::regex_replace(message, std::regex(R"(\s*Object name = (\S*), id = (-?\d+).*)"), " ('$1')");
  message = std::regex_replace(message, std::regex(R"(\s*Element '(\w+)', line.*)"), " (<$1>)");
  message = std::regex_replace(message, std::regex(R"(^(XML )?Error: )"), "");
  message = std::regex_replace(message, std::regex(R"(( in object '' \(id = \d+\))?( \(''\))?$)"), "");
  message = std::regex_replace(message, std::regex(R"(('[^']+')(.*) \(\1\)$)"), "$1$2");
  message = std::regex_replace(message, std::regex(R"(\s+)"), " ");
  while (!message.empty() && message.back() == ' ') message.pop_back();
  return (source.empty() ? "scene" : source) + ": MuJoCo: " + message;
}

}  // namespace

ModelPtr CompileModel(const SceneComposer& composer, bool discard_visual,
                      std::vector<std::string>* warnings) {
  constexpr const char* kFile = "scene.xml";
  const VfsPtr vfs = MakeVfs();
  AddToVfs(kFile, composer.ToXml(discard_visual), vfs.get());

  const MujocoCompileGuard guard(warnings);
  char message[2000] = "";
  ModelPtr model(mj_loadXML(kFile, vfs.get(), message, sizeof(message)));
  if (!model) throw InputError(Translate(message, composer, discard_visual));
  if (*message) warnings->push_back(Translate(message, composer, discard_visual));
  // Visual models are not simulated.
  if (discard_visual) ReserveKnownGaps(model.get());
  return model;
}

}  // namespace evalbus
