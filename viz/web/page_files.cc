#include "viz/web/page_files.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>

#include "viz/web/page_texts.h"

namespace evalbus::viz {
namespace {

struct OfThree {
  const char* name;
  const char* file;
};
constexpr std::array kOfThree = {OfThree{"three.min.js", "build/three.min.js"},
                                 OfThree{"OrbitControls.js", "examples/js/controls/OrbitControls.js"}};

std::string TypeOf(const std::string& name) {
  const std::string ending = std::filesystem::path(name).extension();
  if (ending == ".html") return "text/html; charset=utf-8";
  if (ending == ".css") return "text/css; charset=utf-8";
  if (ending == ".svg") return "image/svg+xml";
  return "text/javascript; charset=utf-8";
}

WebAnswer File(const std::string& name, std::string text) {
  WebAnswer answer;
  answer.type = TypeOf(name);
  answer.body = std::make_shared<const std::string>(std::move(text));
  return answer;
}

}  // namespace

WebAnswer PageFile(const std::string& name) {
  for (const PageText* text = kPageTexts; text->name != nullptr; ++text) {
    if (text->name == name) return File(name, text->text);
  }
  for (const OfThree& file : kOfThree) {
    if (file.name != name) continue;
    std::ifstream stream(std::filesystem::path(THREE_JS_FOLDER) / file.file, std::ios::binary);
    if (!stream) return WebAnswer::Text(500, "no three.js here; fix: apt-get install libjs-three");
    return File(name, {std::istreambuf_iterator<char>(stream), {}});
  }
  return WebAnswer::Text(404, "the page has no such file");
}

}  // namespace evalbus::viz
