#include "policy_bridge/contract/contract.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "base/input_file.h"
#include "models/task_description.h"
#include "models/yaml_reader.h"

namespace evalbus::policy {
namespace {

constexpr double kLongest = 1e6;      // s
constexpr double kLargestStep = 100;  // rad
constexpr int kMaxPixels = 2048;
constexpr int kMaxSteps = 10'000;
constexpr int kMaxValues = 1000;
constexpr int kLargestBatch = 1024;
constexpr int kLargestConstant = 1'000'000'000;
constexpr int kLongestHistory = 1000;  // ticks

constexpr Named<Wire> kWires[] = {{"openpi", Wire::kOpenpi},    {"roboarena", Wire::kRoboArena},
                                  {"vla_eval", Wire::kVlaEval}, {"groot", Wire::kGroot},
                                  {"rest", Wire::kRest},        {"xpolicylab", Wire::kXPolicyLab}};
constexpr Named<ClientOptions::GrootDialect> kDialects[] = {
    {"detect", ClientOptions::GrootDialect::kDetect},
    {"n1.5", ClientOptions::GrootDialect::kN15},
    {"n1.6", ClientOptions::GrootDialect::kN16},
    {"n1.6_flat", ClientOptions::GrootDialect::kN16Flat}};
constexpr Named<const char*> kTypes[] = {{"float32", "<f4"}, {"float64", "<f8"}, {"uint8", "|u1"}};
constexpr Named<bool> kLayouts[] = {{"hwc", false}, {"chw", true}};
constexpr Named<bool> kColors[] = {{"rgb", false}, {"bgr", true}};
constexpr Named<ObservationEntry::Committed> kCommitted[] = {
    {"actions", ObservationEntry::Committed::kActions},
    {"delay_steps", ObservationEntry::Committed::kDelaySteps}};
constexpr Named<ObservationEntry::Counter> kCounters[] = {
    {"episode", ObservationEntry::Counter::kEpisode},
    {"tick", ObservationEntry::Counter::kTick},
    {"observation", ObservationEntry::Counter::kObservation}};
constexpr Named<bool> kModes[] = {{"pad", true}, {"stretch", false}};

template <class Choice, size_t N>
Choice Choose(const YamlValue& value, const Named<Choice> (&words)[N]) {
  const std::string text = value.Text();
  std::vector<std::string> known;
  for (const auto& [name, choice] : words) {
    if (text == name) return choice;
    known.emplace_back(name);
  }
  value.Fail("unknown '" + text + "'" + Suggestion(text, known));
}

template <class Choice, size_t N>
void Choose(const YamlMap& map, const char* key, const Named<Choice> (&words)[N], Choice* choice) {
  if (const YamlValue* value = map.Find(key)) *choice = Choose(*value, words);
}

std::vector<int> Integers(const YamlValue& value, int min, int max) {
  std::vector<int> numbers;
  for (const YamlValue& element : value.List()) numbers.push_back(element.Integer(min, max));
  return numbers;
}

// Reads a list of indices ([0, 1, 5]) or a range ("0-6", which includes both ends).
std::vector<int> Indices(const YamlValue& value) {
  if (value.is_list()) {
    std::vector<int> numbers = Integers(value, 0, kMaxValues);
    if (numbers.empty()) value.Fail("expected at least one index");
    return numbers;
  }
  const std::string text = value.Text();
  int first = 0, last = 0, end = 0;
  if (std::sscanf(text.c_str(), "%9d-%9d%n", &first, &last, &end) != 2 ||
      end != static_cast<int>(text.size()) || first < 0 || last < first || last > kMaxValues) {
    value.Fail("expected a list of indices or FIRST-LAST, for example 0-6, got '" + text + "'");
  }
  std::vector<int> numbers;
  for (int i = first; i <= last; ++i) numbers.push_back(i);
  return numbers;
}

std::vector<std::string> Key(const YamlValue& value) {
  if (!value.is_list()) return {value.Text()};
  std::vector<std::string> key = value.Texts();
  if (key.empty()) value.Fail("expected at least one key");
  return key;
}

std::pair<int, int> Size(const YamlValue& value) {
  const std::vector<YamlValue> size = value.List();
  if (size.size() != 2) value.Fail("expected [WIDTH, HEIGHT]");
  return {size[0].Integer(1, kMaxPixels), size[1].Integer(1, kMaxPixels)};
}

ImageForm ReadImage(const YamlMap& map, bool is_depth) {
  ImageForm form;
  form.view.camera = map[is_depth ? "depth" : "camera"].Text();
  const YamlValue* size = map.Find("size_px");
  if (!size)
    map.value().Fail("expected 'size_px': [WIDTH, HEIGHT], the size in which the camera's image is rendered");
  std::tie(form.view.width_px, form.view.height_px) = Size(*size);
  if (const YamlValue* fovy = map.Find("fovy_deg")) {
    form.view.fovy_deg = fovy->Number({.min = 1, .max = 170});
  }
  form.view.shadows = true;
  if (const YamlValue* shadows = map.Find("shadows")) form.view.shadows = shadows->Bool();
  form.view.encoding = is_depth ? "depth32" : "rgb8";
  if (const YamlValue* rotate = map.Find("rotate_deg")) {
    form.rotate_deg = rotate->Integer(0, 270);
    if (form.rotate_deg % 90 != 0) rotate->Fail("expected 0, 90, 180 or 270");
  }
  if (const YamlValue* mirror = map.Find("mirror")) form.mirror = mirror->Bool();
  if (const YamlValue* resize = map.Find("resize_px")) {
    if (is_depth) resize->Fail("depth cannot be resized; set 'size_px' to this size");
    std::tie(form.width_px, form.height_px) = Size(*resize);
  }
  Choose(map, "resize", kModes, &form.pad);
  Choose(map, "color", kColors, &form.bgr);
  Choose(map, "layout", kLayouts, &form.chw);
  for (const char* key : {"color", "layout", "resize"}) {
    if (const YamlValue* value = map.Find(key); value && is_depth)
      value->Fail("not allowed for depth images");
  }
  if (const YamlValue* mode = map.Find("resize"); mode && !map.Find("resize_px")) {
    mode->Fail("requires 'resize_px'");
  }
  return form;
}

Signal ReadSignal(const YamlValue& value) {
  Signal signal;
  if (value.is_scalar()) {
    signal.name = value.Text();
  } else {
    const YamlMap map(value, {"signal"}, {"indices", "scale", "offset", "decimals", "frame", "point"});
    signal.name = map["signal"].Text();
    if (const YamlValue* indices = map.Find("indices")) signal.indices = Indices(*indices);
    if (const YamlValue* scale = map.Find("scale")) {
      signal.scale = scale->Number();
      if (signal.scale == 0) scale->Fail("expected a number other than 0");
    }
    if (const YamlValue* offset = map.Find("offset")) signal.offset = offset->Number();
    if (const YamlValue* decimals = map.Find("decimals")) signal.decimals = decimals->Integer(0, 9);
    Choose(map, "frame", kActionFrames, &signal.frame);
    Choose(map, "point", kEefPoints, &signal.point);
    if (signal.frame == ActionFrame::kWrist) map.Find("frame")->Fail("expected world or base");
  }
  const size_t dot = signal.name.rfind('.');
  const std::string what = dot == std::string::npos ? signal.name : signal.name.substr(dot + 1);
  const std::vector<std::string>& known = signal.is_privileged() ? ObjectSignalNames() : ArmSignalNames();
  if (dot == std::string::npos || dot == 0) {
    value.Fail("expected ARM.SIGNAL or object.NAME.SIGNAL, for example left.joint_position_rad, got '" +
               signal.name + "'");
  }
  if (std::ranges::find(known, what) == known.end()) {
    value.Fail("unknown signal '" + what + "'" + Suggestion(what, known));
  }
  // Objects have only poses, which refer to no point of an arm.
  const bool is_pose = std::ranges::find(ObjectSignalNames(), what) != ObjectSignalNames().end();
  const bool has_point = is_pose && !signal.is_privileged();
  for (const YamlValue& entry : value.is_map() ? value.Entries() : std::vector<YamlValue>()) {
    if ((entry.key() == "frame" && !is_pose) || (entry.key() == "point" && !has_point))
      entry.Fail("only allowed for poses of arms");
  }
  return signal;
}

Value ReadConstant(const YamlValue& value) {
  if (value.is_list()) {
    const std::vector<double> numbers = value.Numbers();
    return FloatArray(numbers, {static_cast<int64_t>(numbers.size())});
  }
  if (value.is_map()) {
    return YamlMap(value, {"integer"}, {})["integer"].Integer(-kLargestConstant, kLargestConstant);
  }
  // The server would receive a text, and not the number that was meant.
  if (value.is_number()) {
    const std::string text = value.Text();
    value.Fail(
        fmt::format("expected {{integer: {0}}} for a whole number, [{0}] for a float32 or '{0}' for a text, "
                    "got {0} without quotes",
                    text));
  }
  return value.Text();
}

ObservationEntry ReadEntry(const YamlValue& value) {
  const std::vector<const char*> sources = {"camera",   "depth",   "state",    "prompt",
                                            "constant", "counter", "committed"};
  const YamlMap map(value, {"key"},
                    {"camera", "depth", "state", "prompt", "constant", "counter", "committed", "size_px",
                     "fovy_deg", "shadows", "rotate_deg", "mirror", "resize_px", "resize", "color", "layout",
                     "type", "shape", "history_ticks"});
  ObservationEntry entry;
  entry.key = Key(map["key"]);
  int found = 0;
  for (const char* source : sources) found += map.Find(source) != nullptr;
  if (found != 1)
    map.value().Fail("expected one of camera, depth, state, prompt, constant, counter, committed");

  const bool is_image = map.Find("camera") || map.Find("depth");
  for (const char* key :
       {"size_px", "fovy_deg", "shadows", "rotate_deg", "mirror", "resize_px", "resize", "color", "layout"}) {
    if (const YamlValue* wrong = map.Find(key); wrong && !is_image)
      wrong->Fail("only allowed for a camera or depth");
  }
  for (const char* key : {"type", "shape"}) {
    if (const YamlValue* wrong = map.Find(key); wrong && !map.Find("state"))
      wrong->Fail("only allowed for a state");
  }
  if (const YamlValue* history = map.Find("history_ticks")) {
    if (!is_image && !map.Find("state")) history->Fail("only allowed for a camera, depth or a state");
    entry.history_ticks = Integers(*history, -kLongestHistory, 0);
    if (entry.history_ticks.empty() || !std::ranges::is_sorted(entry.history_ticks) ||
        entry.history_ticks.back() != 0) {
      history->Fail(
          "expected control ticks relative to now, oldest first, the last one 0, for example [-15, 0]");
    }
  }

  if (is_image) {
    entry.source = map.Find("depth") ? ObservationEntry::Source::kDepth : ObservationEntry::Source::kCamera;
    entry.image = ReadImage(map, map.Find("depth") != nullptr);
  } else if (const YamlValue* state = map.Find("state")) {
    entry.source = ObservationEntry::Source::kState;
    for (const YamlValue& signal : state->is_list() ? state->List() : std::vector{*state}) {
      entry.signals.push_back(ReadSignal(signal));
    }
    if (entry.signals.empty()) state->Fail("expected at least one signal");
    if (const YamlValue* type = map.Find("type")) {
      entry.dtype = Choose(*type, kTypes);
      // Without `decimals: 0`, a user may not notice that meters and radians are truncated to whole numbers.
      if (entry.dtype == "|u1" &&
          !std::ranges::all_of(entry.signals, [](const Signal& signal) { return signal.decimals == 0; })) {
        type->Fail("requires 'decimals: 0' for each signal, and usually a 'scale', for example 255");
      }
    }
    if (const YamlValue* shape = map.Find("shape")) {
      entry.shape.emplace();
      for (const int size : Integers(*shape, 1, kMaxValues)) entry.shape->push_back(size);
    }
  } else if (const YamlValue* prompt = map.Find("prompt")) {
    entry.source = ObservationEntry::Source::kPrompt;
    if (!prompt->Bool()) prompt->Fail("expected true");
  } else if (const YamlValue* counter = map.Find("counter")) {
    entry.source = ObservationEntry::Source::kCounter;
    entry.counter = Choose(*counter, kCounters);
  } else if (const YamlValue* committed = map.Find("committed")) {
    entry.source = ObservationEntry::Source::kCommitted;
    entry.committed = Choose(*committed, kCommitted);
  } else {
    entry.source = ObservationEntry::Source::kConstant;
    entry.constant = ReadConstant(map["constant"]);
  }
  return entry;
}

std::vector<ObservationEntry> ReadObservation(const YamlValue& value) {
  std::vector<ObservationEntry> entries;
  for (const YamlValue& element : value.List()) {
    const ObservationEntry entry = ReadEntry(element);
    for (const ObservationEntry& other : entries) {
      if (entry.KeyText() == other.KeyText()) element.Fail("key '" + entry.KeyText() + "' given twice");
      const auto [own, its] = std::ranges::mismatch(entry.key, other.key);
      if (own != entry.key.end() && its != other.key.end()) continue;
      element.Fail("keys '" + other.KeyText() + "' and '" + entry.KeyText() +
                   "': one is the map that contains the other");
    }
    entries.push_back(entry);
  }
  if (entries.empty()) value.Fail("expected at least one entry");
  return entries;
}

GripperForm ReadGripper(const YamlValue& value, int num_values) {
  const YamlMap map(value, {"index", "open", "closed"}, {"threshold", "sticky_steps"});
  GripperForm gripper;
  gripper.index = map["index"].Integer(0, num_values - 1);
  gripper.open = map["open"].Number();
  gripper.closed = map["closed"].Number();
  if (gripper.open == gripper.closed) map["closed"].Fail("expected a number other than 'open'");
  if (const YamlValue* threshold = map.Find("threshold")) {
    const double number = threshold->Number();
    const double closing = (number - gripper.open) / (gripper.closed - gripper.open);
    if (closing < 0 || closing >= 1) threshold->Fail("expected a number between 'open' and 'closed'");
    gripper.threshold = closing;
  }
  if (const YamlValue* sticky = map.Find("sticky_steps")) {
    gripper.sticky_steps = sticky->Integer(1, kMaxSteps);
    if (!gripper.threshold) sticky->Fail("requires 'threshold'");
  }
  return gripper;
}

ArmForm ReadArm(const YamlValue& value, int num_values) {
  const YamlMap map(value, {"arm", "indices"}, {"gripper"});
  ArmForm arm;
  arm.arm = map["arm"].Text();
  arm.indices = Indices(map["indices"]);
  for (const int index : arm.indices) {
    if (index >= num_values)
      map["indices"].Fail("expected indices less than 'values', " + std::to_string(num_values));
  }
  if (const YamlValue* gripper = map.Find("gripper")) arm.gripper = ReadGripper(*gripper, num_values);
  return arm;
}

// Reads one number that applies to all values of a row, or a list with one number for each value.
void ReadPerValue(const YamlMap& map, const char* key, int num_values, std::vector<double>* numbers) {
  const YamlValue* value = map.Find(key);
  if (!value) return;
  *numbers = value->is_list() ? value->Numbers(static_cast<size_t>(num_values))
                              : std::vector<double>(static_cast<size_t>(num_values), value->Number());
}

void ReadAction(const YamlValue& value, Contract* contract) {
  const YamlMap map(value, {"kind", "values", "arms", "execute_steps"},
                    {"keys", "delta_on", "frame", "point", "rotation", "chunk_steps", "scale", "offset",
                     "lower", "upper", "first_step_rad"});
  ActionSpace& space = contract->actions;
  space.kind = Choose(map["kind"], kActionKinds);
  space.num_values = map["values"].Integer(1, kMaxValues);
  Choose(map, "delta_on", kDeltaOns, &space.delta_on);
  Choose(map, "frame", kActionFrames, &space.frame);
  Choose(map, "point", kEefPoints, &space.point);
  Choose(map, "rotation", kRotationForms, &space.rotation);
  const bool is_eef = space.kind == ActionKind::kEefPose || space.kind == ActionKind::kEefDelta;
  const bool is_delta = IsDelta(space.kind);
  for (const char* key : {"frame", "point", "rotation"}) {
    if (const YamlValue* wrong = map.Find(key); wrong && !is_eef)
      wrong->Fail("only allowed for eef_pose and eef_delta");
    if (is_eef && !map.Find(key)) map.value().Fail(std::string("expected '") + key + "' with this kind");
  }
  if (const YamlValue* wrong = map.Find("delta_on"); wrong && !is_delta)
    wrong->Fail("only allowed for deltas and velocities");
  if (is_delta && !map.Find("delta_on"))
    map.value().Fail("expected 'delta_on', target or measured, with this kind");
  if (space.kind == ActionKind::kEefPose && space.frame == ActionFrame::kWrist) {
    map["frame"].Fail("a pose must be in the world or base frame");
  }
  for (const YamlValue& arm : map["arms"].List()) {
    space.arms.push_back(ReadArm(arm, space.num_values));
    const size_t pose = is_eef ? 3 + static_cast<size_t>(NumValues(space.rotation)) : 0;
    if (is_eef && space.arms.back().indices.size() != pose) {
      arm.Fail(fmt::format("indices: expected {}: 3 for the position, {} for the rotation", pose, pose - 3));
    }
    for (size_t i = 0; i + 1 < space.arms.size(); ++i) {
      if (space.arms[i].arm == space.arms.back().arm) arm.Fail("arm '" + space.arms[i].arm + "' given twice");
    }
  }
  if (space.arms.empty()) map["arms"].Fail("expected at least one arm");
  ReadPerValue(map, "scale", space.num_values, &space.scale);
  ReadPerValue(map, "offset", space.num_values, &space.offset);
  ReadPerValue(map, "lower", space.num_values, &space.lower);
  ReadPerValue(map, "upper", space.num_values, &space.upper);
  for (size_t i = 0; i < std::min(space.lower.size(), space.upper.size()); ++i) {
    if (space.lower[i] > space.upper[i])
      map.Find("upper")->Fail("value " + std::to_string(i) + ": expected at least that of 'lower'");
  }
  contract->action_keys = {"actions"};
  if (const YamlValue* keys = map.Find("keys")) {
    contract->action_keys = keys->Texts();
    if (contract->action_keys.empty()) keys->Fail("expected at least one key");
  }
  contract->execute_steps = map["execute_steps"].Integer(1, kMaxSteps);
  if (const YamlValue* steps = map.Find("chunk_steps")) {
    contract->chunk_steps = steps->Integer(1, kMaxSteps);
    if (contract->execute_steps > *contract->chunk_steps) {
      map["execute_steps"].Fail("expected at most 'chunk_steps', " + std::to_string(*contract->chunk_steps));
    }
  }
  if (const YamlValue* limit = map.Find("first_step_rad"))
    contract->first_step_rad = limit->Number({.min = 0, .max = kLargestStep, .open_min = true});
}

nlohmann::ordered_json ImageJson(const ImageForm& form) {
  nlohmann::ordered_json json = {
      {"camera", form.view.camera},     {"size_px", {form.view.width_px, form.view.height_px}},
      {"fovy_deg", form.view.fovy_deg}, {"shadows", form.view.shadows != 0},
      {"rotate_deg", form.rotate_deg},  {"mirror", form.mirror}};
  if (form.width_px > 0) {
    json["resize_px"] = {form.width_px, form.height_px};
    json["resize"] = WordOf(form.pad, kModes);
  }
  json["color"] = WordOf(form.bgr, kColors);
  json["layout"] = WordOf(form.chw, kLayouts);
  return json;
}

nlohmann::ordered_json SignalJson(const Signal& signal) {
  nlohmann::ordered_json json = {{"signal", signal.name}};
  if (!signal.indices.empty()) json["indices"] = signal.indices;
  if (signal.scale != 1) json["scale"] = signal.scale;
  if (signal.offset != 0) json["offset"] = signal.offset;
  if (signal.decimals >= 0) json["decimals"] = signal.decimals;
  if (signal.frame != ActionFrame::kWorld) json["frame"] = WordOf(signal.frame, kActionFrames);
  if (signal.point != EefPoint::kFlange) json["point"] = WordOf(signal.point, kEefPoints);
  return json;
}

// Returns a constant as ReadConstant() reads it. Numbers are float32, as they are sent.
nlohmann::ordered_json ConstantJson(const Value& constant) {
  if (const auto* array = constant.As<Array>()) return Numbers(*array);
  if (const auto* integer = constant.As<int64_t>()) return {{"integer", *integer}};
  return TextOrDescription(constant);
}

nlohmann::ordered_json EntryJson(const ObservationEntry& entry) {
  nlohmann::ordered_json json = {{"key", entry.KeyText()}};
  using Source = ObservationEntry::Source;
  switch (entry.source) {
    case Source::kCamera:
    case Source::kDepth:
      json["image"] = ImageJson(entry.image);
      if (entry.source == Source::kDepth) json["image"]["depth"] = true;
      break;
    case Source::kState:
      for (const Signal& signal : entry.signals) json["state"].push_back(SignalJson(signal));
      json["type"] = entry.dtype;
      if (entry.shape) json["shape"] = *entry.shape;
      break;
    case Source::kPrompt:
      json["prompt"] = true;
      break;
    case Source::kConstant:
      json["constant"] = ConstantJson(entry.constant);
      break;
    case Source::kCounter:
      json["counter"] = WordOf(entry.counter, kCounters);
      break;
    case Source::kCommitted:
      json["committed"] = WordOf(entry.committed, kCommitted);
      break;
  }
  if (!entry.history_ticks.empty()) json["history_ticks"] = entry.history_ticks;
  return json;
}

nlohmann::ordered_json ActionJson(const Contract& contract) {
  const ActionSpace& space = contract.actions;
  nlohmann::ordered_json json = {{"keys", contract.action_keys}, {"kind", NameOf(space.kind)}};
  if (IsDelta(space.kind)) {
    json["delta_on"] = WordOf(space.delta_on, kDeltaOns);
  }
  if (space.kind == ActionKind::kEefPose || space.kind == ActionKind::kEefDelta) {
    json["frame"] = WordOf(space.frame, kActionFrames);
    json["point"] = WordOf(space.point, kEefPoints);
    json["rotation"] = WordOf(space.rotation, kRotationForms);
  }
  json["values"] = space.num_values;
  for (const ArmForm& arm : space.arms) {
    nlohmann::ordered_json one = {{"arm", arm.arm}, {"indices", arm.indices}};
    if (const GripperForm& gripper = arm.gripper; gripper.index) {
      one["gripper"] = {{"index", *gripper.index}, {"open", gripper.open}, {"closed", gripper.closed}};
      if (gripper.threshold) {
        one["gripper"]["threshold"] = gripper.open + *gripper.threshold * (gripper.closed - gripper.open);
        one["gripper"]["sticky_steps"] = gripper.sticky_steps;
      }
    }
    json["arms"].push_back(one);
  }
  const auto add = [&](const char* key, const std::vector<double>& numbers) {
    if (!numbers.empty()) json[key] = numbers;
  };
  add("scale", space.scale);
  add("offset", space.offset);
  add("lower", space.lower);
  add("upper", space.upper);
  json["chunk_steps"] = contract.chunk_steps ? nlohmann::ordered_json(*contract.chunk_steps) : nullptr;
  json["execute_steps"] = contract.execute_steps;
  if (contract.first_step_rad) json["first_step_rad"] = *contract.first_step_rad;
  return json;
}

}  // namespace

std::string ObservationEntry::KeyText() const {
  std::string text;
  for (const std::string& part : key) text += (text.empty() ? "" : ".") + part;
  return text;
}

bool Contract::is_privileged() const {
  return std::ranges::any_of(observation, [](const ObservationEntry& entry) {
    return std::ranges::any_of(entry.signals, &Signal::is_privileged);
  });
}

bool Contract::takes_committed_actions() const {
  return std::ranges::any_of(observation, [](const ObservationEntry& entry) {
    return entry.source == ObservationEntry::Source::kCommitted &&
           entry.committed == ObservationEntry::Committed::kActions;
  });
}

bool Contract::needs_images() const { return std::ranges::any_of(observation, &ObservationEntry::is_image); }

std::string Contract::PromptFor(const std::string& task, const std::string& instruction) const {
  const auto own = prompts.find(task);
  return own == prompts.end() ? instruction : own->second;
}

Contract ParseContract(const std::string& text, const std::filesystem::path& file) {
  const YamlMap map(ParseYaml(text, file.string()), {"wire", "url", "rate_hz", "observation", "action"},
                    {"description", "groot_dialect", "api_key_env", "deadlines", "batch_size", "settle_steps",
                     "answer_window", "prompts", "trained_on"});
  Contract contract;
  contract.name = file.stem();
  contract.file = file;
  contract.text = text;
  if (const YamlValue* description = map.Find("description")) contract.description = description->Text();
  if (map["wire"].Text() == "lerobot") map["wire"].Fail(kNoPickles);
  contract.wire = Choose(map["wire"], kWires);
  if (const YamlValue* dialect = map.Find("groot_dialect")) {
    if (contract.wire != Wire::kGroot) dialect->Fail("only allowed for the wire groot");
    contract.groot_dialect = Choose(*dialect, kDialects);
  }
  contract.url = map["url"].Text();
  try {
    ClientOptions options;
    options.wire = contract.wire;
    options.url = contract.url;
    MakePolicyClient(options);
  } catch (const InputError& error) {
    map["url"].Fail(error.what());
  }
  if (const YamlValue* variable = map.Find("api_key_env")) contract.api_key_env = variable->Text();
  if (const YamlValue* value = map.Find("deadlines")) {
    const YamlMap deadlines(*value, {}, {"connect_s", "first_reply_s", "reply_s", "return_s"});
    constexpr NumberRange kSeconds{.min = 0.001, .max = kLongest};
    const auto read = [&](const char* key, double* seconds) {
      if (const YamlValue* given = deadlines.Find(key)) *seconds = given->Number(kSeconds);
    };
    read("connect_s", &contract.deadlines.connect_s);
    read("first_reply_s", &contract.deadlines.first_reply_s);
    read("reply_s", &contract.deadlines.reply_s);
    read("return_s", &contract.deadlines.return_s);
  }
  if (const YamlValue* batch = map.Find("batch_size")) {
    if (contract.wire != Wire::kGroot) {
      batch->Fail(
          "only allowed for the wire groot; servers of other wires can batch the requests of their "
          "connections themselves");
    }
    contract.batch_size = batch->Integer(1, kLargestBatch);
  }
  contract.rate_hz = map["rate_hz"].Number({.min = 5, .max = 500});
  if (const YamlValue* settle = map.Find("settle_steps"))
    contract.settle_steps = settle->Integer(0, kMaxSteps);
  if (const YamlValue* window = map.Find("answer_window")) {
    contract.answer_window = window->Number({.min = 0, .max = 0.9});
  }
  contract.observation = ReadObservation(map["observation"]);
  if (const YamlValue* prompts = map.Find("prompts")) {
    for (const YamlValue& prompt : prompts->Entries()) contract.prompts[prompt.key()] = prompt.Text();
  }
  if (const YamlValue* sets = map.Find("trained_on")) {
    for (const YamlValue& set : sets->is_list() ? sets->List() : std::vector{*sets}) {
      contract.trained_on.push_back(
          {set.Text(), OneLine(set.location().ToString() + ": key '" + set.key() + "'")});
    }
    if (contract.trained_on.empty()) sets->Fail("expected at least one run folder or training set");
  }
  ReadAction(map["action"], &contract);
  return contract;
}

Contract ReadContract(const std::filesystem::path& file) {
  return ParseContract(ReadInput(file, "policy contract"), file);
}

std::filesystem::path PoliciesFolder() { return ModelsFolder() / "policies"; }

std::vector<Contract> AllContracts() {
  std::vector<Contract> contracts;
  if (!std::filesystem::is_directory(PoliciesFolder())) return contracts;
  for (const auto& entry : std::filesystem::directory_iterator(PoliciesFolder())) {
    if (entry.path().extension() == ".yaml") contracts.push_back(ReadContract(entry.path()));
  }
  std::ranges::sort(contracts, {}, &Contract::name);
  return contracts;
}

InputError InContract(const Contract& contract, const std::string& what) {
  return InputError(contract.file.string() + ": " + what);
}

bool IsContractFile(const std::string& name) {
  return (name.ends_with(".yaml") || name.ends_with(".yml")) && name.find(':') == std::string::npos;
}

bool IsContract(const std::string& name) {
  return IsContractFile(name) || (name.find_first_of("/:") == std::string::npos &&
                                  std::filesystem::is_regular_file(PoliciesFolder() / (name + ".yaml")));
}

Contract FindContract(const std::string& name) {
  if (IsContractFile(name)) return ReadContract(name);
  if (IsContract(name)) return ReadContract(PoliciesFolder() / (name + ".yaml"));
  std::vector<std::string> names;
  for (const Contract& contract : AllContracts()) names.push_back(contract.name);
  throw InputError("there is no policy contract '" + name + "'" + Suggestion(name, names));
}

ClientOptions ClientOptionsOf(const Contract& contract) {
  ClientOptions options;
  options.wire = contract.wire;
  options.url = contract.url;
  options.connect_s = contract.deadlines.connect_s;
  options.first_reply_s = contract.deadlines.first_reply_s;
  options.reply_s = contract.deadlines.reply_s;
  options.groot_dialect = contract.groot_dialect;
  if (!contract.api_key_env.empty()) {
    const char* key = std::getenv(contract.api_key_env.c_str());
    if (!key || !*key) {
      throw InContract(
          contract, "api_key_env: the environment variable " + contract.api_key_env + " is unset or empty");
    }
    options.api_key = key;
  }
  if (const char* pool = std::getenv(kPoolVariable); pool && contract.batch_size > 1) options.pool_url = pool;
  return options;
}

const char* NameOf(Wire wire) { return WordOf(wire, kWires); }

nlohmann::ordered_json ContractJson(const Contract& contract) {
  nlohmann::ordered_json json = {
      {"name", contract.name}, {"wire", NameOf(contract.wire)}, {"rate_hz", contract.rate_hz}};
  if (contract.groot_dialect != ClientOptions::GrootDialect::kDetect)
    json["groot_dialect"] = WordOf(contract.groot_dialect, kDialects);
  json["settle_steps"] = contract.settle_steps;
  json["answer_window"] = contract.answer_window;
  json["privileged"] = contract.is_privileged();
  for (const ObservationEntry& entry : contract.observation) json["observation"].push_back(EntryJson(entry));
  if (!contract.prompts.empty()) json["prompts"] = contract.prompts;
  json["action"] = ActionJson(contract);
  return json;
}

}  // namespace evalbus::policy
