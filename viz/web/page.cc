#include "viz/web/page.h"

#include <utility>

#include "base/errors.h"
#include "viz/viewer/page_files.h"

namespace evalbus::viz {
namespace {

WebAnswer Text(const char* type, std::string text) {
  WebAnswer answer;
  answer.type = std::string(type) + "; charset=utf-8";
  answer.body = std::make_shared<const std::string>(std::move(text));
  return answer;
}

}  // namespace

WebAnswer AnswerFile(const std::string& name) {
  constexpr const char* kScript = "text/javascript";
  if (name == "index.html") return Text("text/html", kPageHtml);
  for (const PageFile& file : PageFiles()) {
    if (file.name == name) return Text(name.ends_with(".css") ? "text/css" : kScript, file.text);
  }
  try {
    if (name == "three.min.js") return Text(kScript, ReadThreeJs().three);
    if (name == "OrbitControls.js") return Text(kScript, ReadThreeJs().orbit_controls);
  } catch (const EnvironmentError& error) {
    return WebAnswer::Text(500, error.what());
  }
  return WebAnswer::Text(404, "no such file");
}

}  // namespace evalbus::viz
