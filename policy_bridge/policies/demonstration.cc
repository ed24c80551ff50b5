#include "policy_bridge/policies/demonstration.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/safetensors.h"
#include "base/text.h"

namespace evalbus::policy {
namespace {

namespace fs = std::filesystem;

constexpr char kActions[] = "info_demo_action", kRate[] = "control_frequency";
// No arm joint turns farther than this, rad. Larger values must be degrees.
constexpr double kMaxTurn = 2 * 3.15;

std::optional<double> RateOf(const std::string& text) {
  double hz = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), hz);
  if (end.ec != std::errc() || !(hz > 0) || hz > 1e4) return {};
  return end.ptr == text.data() + text.size() || std::string(end.ptr) == "hz" ? std::optional(hz)
                                                                              : std::nullopt;
}

}  // namespace

Demonstration ReadDemonstration(const fs::path& file) {
  const Safetensors content = ReadSafetensors(file);
  const auto fail = [&](const std::string& what) { throw InputError(file.string() + ": " + what); };
  Demonstration demo;
  demo.file = file;
  const Tensor* actions = content.Find(kActions);
  if (!actions) fail(fmt::format("no tensor \"{}\": this is not a demonstration of RoboEval", kActions));
  if (actions->shape.size() != 2 || actions->shape[1] != static_cast<int64_t>(kDemoWidth) ||
      actions->shape[0] < 1) {
    fail(fmt::format("{}: expected [steps, 16], 7 + 7 joints and 2 grippers, got [{}]", kActions,
                     fmt::join(actions->shape, ", ")));
  }
  // Paths in RoboEval's archive end in ROBOT/TASK/ACTIONS/OBSERVATIONS/FILE. The name of the folder ACTIONS
  // contains "ActionMode".
  const fs::path absolute = fs::absolute(file).lexically_normal();
  std::vector<std::string> folders;
  for (const fs::path& part : absolute.parent_path()) folders.push_back(part.string());
  for (size_t i = 2; i < folders.size(); ++i) {
    if (folders[i].find("ActionMode") == std::string::npos) continue;
    demo.task = folders[i - 1];
    if (folders[i].find("_delta") != std::string::npos || folders[i].ends_with("_end_effector")) {
      fail("its path has the action mode " + folders[i] + "; only absolute joint positions are supported");
    }
  }
  demo.metadata = content.metadata;
  if (const auto about = content.metadata.find("environment_data"); about != content.metadata.end()) {
    const auto json = nlohmann::json::parse(about->second, nullptr, false);
    const auto is = [&](const char* key, bool value) {
      return json.is_object() && json.contains(key) && json[key] == value;
    };
    if (is("action_mode_absolute", false) || is("end_effector_mode", true)) {
      fail("metadata: the actions are " +
           std::string(is("end_effector_mode", true) ? "poses of the hands" : "changes of joint positions") +
           "; only absolute joint positions are supported");
    }
  }
  for (const std::string& folder : folders) {
    if (folder.ends_with("hz") && RateOf(folder)) demo.hz = *RateOf(folder);
  }
  if (const auto rate = content.metadata.find(kRate); rate != content.metadata.end()) {
    const auto hz = RateOf(rate->second);
    if (!hz)
      fail(fmt::format("metadata: {}: expected steps per second, above 0 and at most 10000, got {}", kRate,
                       Printable(Cut(rate->second, 40))));
    demo.hz = *hz;
  }
  std::vector<double> numbers;
  try {
    numbers = actions->Numbers();
  } catch (const InputError& error) {
    fail(std::string(kActions) + ": " + error.what());
  }
  demo.steps.resize(numbers.size() / kDemoWidth);
  for (size_t i = 0; i < numbers.size(); ++i) {
    const size_t step = i / kDemoWidth, column = i % kDemoWidth;
    if (!std::isfinite(numbers[i]))
      fail(fmt::format("{}: step {}, column {} is not a finite number", kActions, step, column));
    if (column < kDemoJoints && std::abs(numbers[i]) > kMaxTurn) {
      fail(fmt::format(
          "{}: step {}, column {} is {:g}: outside the range of any joint in radians; are these degrees?",
          kActions, step, column, numbers[i]));
    }
    demo.steps[step][column] = numbers[i];
  }
  return demo;
}

std::vector<fs::path> DemonstrationFiles(const fs::path& path) {
  if (fs::is_regular_file(path)) return {path};
  if (!fs::is_directory(path)) throw InputError(path.string() + ": no such file or folder");
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file() && entry.path().extension() == ".safetensors") files.push_back(entry.path());
  }
  if (files.empty()) throw InputError(path.string() + ": no *.safetensors file in it");
  std::ranges::sort(files);
  return files;
}

Demonstration AtRate(const Demonstration& demonstration, double hz) {
  const double ratio = demonstration.hz / hz;
  const auto window = static_cast<size_t>(std::llround(ratio));
  if (!(hz > 0) || window < 1 || std::abs(ratio - static_cast<double>(window)) > 1e-9 * ratio) {
    throw InputError(fmt::format("{}: its rate of {:g} Hz is not a multiple of {:g} Hz",
                                 demonstration.file.string(), demonstration.hz, hz));
  }
  Demonstration result = demonstration;
  result.hz = hz;
  result.steps.clear();
  const size_t count = demonstration.steps.size();
  for (size_t begin = 0; begin < count; begin += window) {
    const auto at = [&](size_t k) { return demonstration.steps[std::min(begin + k, count - 1)]; };
    std::array<double, kDemoWidth> step = at(window - 1);
    for (size_t column = 0; column < kDemoJoints; ++column) {
      double sum = 0;
      for (size_t k = 0; k < window; ++k) sum += at(k)[column];
      step[column] = sum / static_cast<double>(window);
    }
    result.steps.push_back(step);
  }
  return result;
}

std::string AsSafetensors(const Demonstration& demonstration) {
  const auto count = static_cast<int64_t>(demonstration.steps.size());
  std::vector<double> actions;
  for (const auto& step : demonstration.steps) actions.insert(actions.end(), step.begin(), step.end());
  std::vector<uint8_t> last(demonstration.steps.size());
  last.back() = 1;
  Safetensors content;
  content.tensors = {{"info_demo_action", DoubleTensor(actions, {count, static_cast<int64_t>(kDemoWidth)})},
                     {"reward", DoubleTensor({}, {0})},
                     {"termination", ByteTensor(last, {count}, "BOOL")},
                     {"truncation", ByteTensor(std::vector<uint8_t>(last.size()), {count}, "BOOL")}};
  content.metadata = demonstration.metadata;
  content.metadata["observation_mode"] = "\"lightweight\"";
  content.metadata[kRate] = fmt::format("{:g}", demonstration.hz);
  return EncodeSafetensors(content);
}

std::string AsCsv(const Demonstration& demonstration) {
  std::string text = "time_s";
  for (const char* arm : {"left", "right"}) {
    for (int joint = 1; joint <= 7; ++joint) text += fmt::format(",{}_joint{}", arm, joint);
  }
  text += ",left_gripper,right_gripper\n";
  for (size_t i = 0; i < demonstration.steps.size(); ++i) {
    text += fmt::format("{}", static_cast<double>(i) / demonstration.hz);
    for (const double number : demonstration.steps[i]) text += fmt::format(",{}", number);
    text += "\n";
  }
  return text;
}

}  // namespace evalbus::policy
