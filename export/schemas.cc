#include "export/schemas.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/json_file.h"

namespace evalbus::exports {
namespace {

using Json = nlohmann::ordered_json;

const Json kNumber = {{"type", "number"}};
const Json kInteger = {{"type", "integer"}};
const Json kText = {{"type", "string"}};
const Json kTruth = {{"type", "boolean"}};

Json Described(Json schema, const std::string& text) {
  schema["description"] = text;
  return schema;
}

Json ArrayOf(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

// Returns the schema of an object. All members are required, except the ones in `optional`.
Json Object(const Json& properties, const std::vector<std::string>& optional = {}) {
  Json required = Json::array();
  for (const auto& [name, schema] : properties.items()) {
    if (std::ranges::find(optional, name) == optional.end()) required.push_back(name);
  }
  return {{"type", "object"}, {"properties", properties}, {"required", required}};
}

Json Titled(const std::string& title, Json schema) {
  Json titled = {{"title", title}};
  titled.update(schema);
  return titled;
}

Json Time() {
  Json time = Object({{"sec", {{"type", "integer"}, {"minimum", 0}}},
                      {"nsec", {{"type", "integer"}, {"minimum", 0}, {"maximum", 999999999}}}});
  time["title"] = "time";
  return time;
}

Json Vector() { return Object({{"x", kNumber}, {"y", kNumber}, {"z", kNumber}}); }
Json Quaternion() { return Object({{"x", kNumber}, {"y", kNumber}, {"z", kNumber}, {"w", kNumber}}); }
Json Pose() { return Object({{"position", Vector()}, {"orientation", Quaternion()}}); }
Json Color() { return Object({{"r", kNumber}, {"g", kNumber}, {"b", kNumber}, {"a", kNumber}}); }

std::string Text(const std::string& title, const Json& schema) { return ToText(Titled(title, schema)); }

}  // namespace

std::string FrameTransformsSchema() {
  const Json transform = Object({{"timestamp", Time()},
                                 {"parent_frame_id", kText},
                                 {"child_frame_id", kText},
                                 {"translation", Vector()},
                                 {"rotation", Quaternion()}});
  return Text("foxglove.FrameTransforms", Object({{"transforms", ArrayOf(transform)}}));
}

std::string SceneUpdateSchema() {
  const Json deletion =
      Object({{"timestamp", Time()}, {"type", {{"type", "integer"}, {"enum", {0, 1}}}}, {"id", kText}});
  Json duration = Object({{"sec", kInteger}, {"nsec", kInteger}});
  duration["title"] = "duration";
  const Json solid = Object({{"pose", Pose()}, {"size", Vector()}, {"color", Color()}});
  Json cylinder = solid;
  for (const char* name : {"bottom_scale", "top_scale"}) {
    cylinder["properties"][name] = kNumber;
    cylinder["required"].push_back(name);
  }
  const Json arrow = Object({{"pose", Pose()},
                             {"shaft_length", kNumber},
                             {"shaft_diameter", kNumber},
                             {"head_length", kNumber},
                             {"head_diameter", kNumber},
                             {"color", Color()}});
  const Json triangles = Object({{"pose", Pose()},
                                 {"points", ArrayOf(Vector())},
                                 {"color", Color()},
                                 {"colors", ArrayOf(Color())},
                                 {"indices", ArrayOf(kInteger)}});
  const Json none = {{"type", "array"}, {"maxItems", 0}};
  const Json entity = Object({{"timestamp", Time()},
                              {"frame_id", kText},
                              {"id", kText},
                              {"lifetime", duration},
                              {"frame_locked", kTruth},
                              {"metadata", ArrayOf(Object({{"key", kText}, {"value", kText}}))},
                              {"arrows", ArrayOf(arrow)},
                              {"cubes", ArrayOf(solid)},
                              {"spheres", ArrayOf(solid)},
                              {"cylinders", ArrayOf(cylinder)},
                              {"lines", none},
                              {"triangles", ArrayOf(triangles)},
                              {"texts", none},
                              {"models", none}});
  return Text("foxglove.SceneUpdate",
              Object({{"deletions", ArrayOf(deletion)}, {"entities", ArrayOf(entity)}}));
}

std::string JointStatesSchema() {
  const Json joint = Object({{"name", kText},
                             {"position", Described(kNumber, "rad")},
                             {"velocity", Described(kNumber, "rad/s")},
                             {"effort", Described(kNumber, "N m")}},
                            {"velocity", "effort"});
  return Text("foxglove.JointStates", Object({{"timestamp", Time()}, {"joints", ArrayOf(joint)}}));
}

std::string LogSchema() {
  return Text("foxglove.Log",
              Object({{"timestamp", Time()},
                      {"level", Described({{"type", "integer"}, {"minimum", 0}, {"maximum", 5}},
                                          "1 debug, 2 info, 3 warning, 4 error")},
                      {"message", kText},
                      {"name", kText},
                      {"file", kText},
                      {"line", {{"type", "integer"}, {"minimum", 0}}}}));
}

std::string CompressedImageSchema() {
  return Text("foxglove.CompressedImage",
              Object({{"timestamp", Time()},
                      {"frame_id", kText},
                      {"data", {{"type", "string"}, {"contentEncoding", "base64"}}},
                      {"format", kText}}));
}

std::string RobotSchema() {
  const Json wrist =
      Object({{"position_m", Vector()}, {"orientation", Quaternion()}, {"mechanical_work_J", kNumber}},
             {"mechanical_work_J"});
  return Text("evalbus.Robot",
              Object({{"timestamp", Time()},
                      {"tick", kInteger},
                      {"wrist", Described({{"type", "object"}, {"additionalProperties", wrist}},
                                          "by arm; pose in the world frame")},
                      {"gripper_opening", Described({{"type", "object"}, {"additionalProperties", kNumber}},
                                                    "by gripper: 1 open, 0 closed")},
                      {"action_clips", Described(kInteger, "commands so far that were clipped to limits")},
                      {"deadline_misses",
                       Described(kInteger, "ticks so far at which no action had arrived in time")}}));
}

std::string ContactsSchema() {
  const Json contact = Object({{"a", Described(kText, "geom")},
                               {"b", Described(kText, "geom")},
                               {"distance_m", Described(kNumber, "negative if the geoms penetrate")},
                               {"position_m", Described(Vector(), "world frame")},
                               {"normal", Described(Vector(), "unit vector from a to b, world frame")}});
  return Text("evalbus.Contacts",
              Object({{"timestamp", Time()},
                      {"tick", kInteger},
                      {"count", kInteger},
                      {"clearance_m", Described(kNumber, "robot to scene; not at every tick")},
                      {"contacts", ArrayOf(contact)}},
                     {"clearance_m"}));
}

std::string EventSchema() {
  return Text("evalbus.Event", Object({{"timestamp", Time()},
                                       {"tick", kInteger},
                                       {"kind", kText},
                                       {"text", kText},
                                       {"gripper", kText},
                                       {"object", kText},
                                       {"duration_s", kNumber}}));
}

std::string EpisodeSchema() {
  const Json values = {{"type", "object"}, {"additionalProperties", kNumber}};
  return Text(
      "evalbus.Episode",
      Object({{"timestamp", Time()},
              {"run_id", kText},
              {"task", kText},
              {"variation", kText},
              {"robot", kText},
              {"instruction", kText},
              {"episode", kInteger},
              {"attempt", kInteger},
              {"seed", Described(kText, "a whole number of 64 bits, as text")},
              {"parameters", Described(values, "randomized value in this episode")},
              {"end_reason", kText},
              {"failure_reason", kText},
              {"explanation", kText},
              {"success", kTruth},
              {"complete", kTruth}},
             {"seed", "parameters", "end_reason", "failure_reason", "explanation", "success", "complete"}));
}

std::string MetricsSchema(const std::vector<std::pair<std::string, std::string>>& paths) {
  Json schema = Object({{"timestamp", Time()},
                        {"episode", kInteger},
                        {"tick", kInteger},
                        {"verdict", Described(kInteger, "0 undecided, 1 success, 2 failure")}});
  for (const auto& [path, label] : paths) {
    Json* at = &schema;
    for (size_t begin = 0; begin <= path.size();) {
      const size_t end = std::min(path.find('.', begin), path.size());
      at = &(*at)["properties"][path.substr(begin, end - begin)];
      begin = end + 1;
      if (begin <= path.size()) (*at)["type"] = "object";
    }
    (*at)["type"] = "number";
    (*at)["description"] = label;
  }
  return Text("evalbus.Metrics", schema);
}

}  // namespace evalbus::exports
