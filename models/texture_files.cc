#include "models/texture_files.h"

#include <algorithm>
#include <string>
#include <vector>

#include "base/errors.h"
#include "models/task_description.h"

namespace evalbus {

namespace fs = std::filesystem;

fs::path TextureFile(const NameInFile& choice, const fs::path& task_folder) {
  constexpr const char* kEnding = ".png";
  const auto fail = [&](const std::string& why) {
    throw InputError(choice.location.ToString() + ": " + why);
  };
  if (choice.text.ends_with(kEnding)) {
    for (const fs::path& folder : {task_folder, TasksFolder()}) {
      const fs::path file = (folder / choice.text).lexically_normal();
      if (fs::is_regular_file(file)) return file;
    }
    fail("texture file " + (task_folder / choice.text).lexically_normal().string() + " does not exist");
  }
  const fs::path folder = ModelsFolder() / "textures";
  std::vector<std::string> known = {kPlain};
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == kEnding) known.push_back(entry.path().stem().string());
  }
  std::ranges::sort(known);
  if (std::ranges::find(known, choice.text) == known.end()) {
    std::string names;
    for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
    fail("the scene has no texture '" + choice.text + "'; besides its own, there are " + names +
         ", and files that end in " + kEnding);
  }
  return folder / (choice.text + kEnding);
}

}  // namespace evalbus
