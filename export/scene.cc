#include "export/scene.h"

#include <array>
#include <cmath>
#include <map>
#include <string>

#include "export/encoder.h"
#include "viz/viewer/block.h"

namespace evalbus::exports {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kEndless_m = 10;
constexpr double kPlaneThickness_m = 0.001;
constexpr double kStep_m = 1e-5;

Json VectorJson(double x, double y, double z) { return {{"x", x}, {"y", y}, {"z", z}}; }

Json PoseJson(const Json& position, const Json& quat) {
  return {{"position", VectorJson(position[0], position[1], position[2])},
          {"orientation", {{"x", quat[1]}, {"y", quat[2]}, {"z", quat[3]}, {"w", quat[0]}}}};
}

// Returns the point at height z on a geom's z axis, in the body's frame. quat: the geom's orientation (w, x,
// y, z).
Json Along(const Json& position, const Json& quat, double z) {
  const double w = quat[0], x = quat[1], y = quat[2], k = quat[3];
  return {position[0].get<double>() + z * 2 * (x * k + w * y),
          position[1].get<double>() + z * 2 * (y * k - w * x),
          position[2].get<double>() + z * (1 - 2 * (x * x + y * y))};
}

Json ColorJson(const Json& rgba) { return {{"r", rgba[0]}, {"g", rgba[1]}, {"b", rgba[2]}, {"a", rgba[3]}}; }

double Rounded(double value) { return std::round(value / kStep_m) / std::round(1 / kStep_m); }

Json Triangles(const std::string& mesh) {
  const viz::BlockReader block(mesh);
  Json points = Json::array();
  const std::vector<double> vertices = block.Values("vertices_m");
  for (size_t i = 0; i + 2 < vertices.size(); i += 3) {
    points.push_back(VectorJson(Rounded(vertices[i]), Rounded(vertices[i + 1]), Rounded(vertices[i + 2])));
  }
  Json indices = Json::array();
  for (const double index : block.Values("faces")) indices.push_back(static_cast<int64_t>(index));
  return {{"points", points}, {"indices", indices}};
}

void AddGeom(const Json& geom, const Json& color, const viz::SceneBlocks& scene, Json* entity) {
  const std::string shape = geom["shape"];
  const Json pose = PoseJson(geom["position_m"], geom["quat_wxyz"]);
  const auto add = [&](const char* list, const Json& at, const Json& size) -> Json& {
    return (*entity)[list].emplace_back(Json{{"pose", at}, {"size", size}, {"color", color}});
  };
  if (shape == "mesh") {
    Json triangles = {{"pose", pose}};
    triangles.update(Triangles(scene.blocks().at(geom["mesh"])));
    triangles["color"] = color;
    triangles["colors"] = Json::array();
    (*entity)["triangles"].push_back(std::move(triangles));
    return;
  }
  // MuJoCo stores half sizes.
  const std::array<double, 3> half = geom["size_m"];
  const Json box = VectorJson(2 * half[0], 2 * half[1], 2 * half[2]);
  const auto add_cylinder = [&] {
    Json& cylinder = add("cylinders", pose, VectorJson(2 * half[0], 2 * half[0], 2 * half[1]));
    cylinder["bottom_scale"] = 1;
    cylinder["top_scale"] = 1;
  };
  if (shape == "box") {
    add("cubes", pose, box);
  } else if (shape == "ellipsoid") {
    add("spheres", pose, box);
  } else if (shape == "sphere") {
    add("spheres", pose, VectorJson(2 * half[0], 2 * half[0], 2 * half[0]));
  } else if (shape == "cylinder") {
    add_cylinder();
  } else if (shape == "capsule") {
    add_cylinder();
    for (const double end : {-half[1], half[1]}) {
      const Json at = PoseJson(Along(geom["position_m"], geom["quat_wxyz"], end), geom["quat_wxyz"]);
      add("spheres", at, VectorJson(2 * half[0], 2 * half[0], 2 * half[0]));
    }
  } else if (shape == "plane") {
    const auto size = [](double side) { return side > 0 ? 2 * side : kEndless_m; };
    // A plane is shown as the upper side of a thin box.
    const Json at =
        PoseJson(Along(geom["position_m"], geom["quat_wxyz"], -kPlaneThickness_m / 2), geom["quat_wxyz"]);
    add("cubes", at, VectorJson(size(half[0]), size(half[1]), kPlaneThickness_m));
  }
}

}  // namespace

Json SceneEntities(const viz::SceneBlocks& scene, const Json& appearance) {
  Json head = viz::BlockReader(scene.blocks().at(scene.id())).head();
  for (const char* list : {"materials", "geoms"}) {
    if (appearance.is_null()) break;
    for (const Json& change : appearance[list]) head[list][change[0].get<size_t>()].update(change[1]);
  }
  std::map<int, Json> entities;
  for (const Json& geom : head["geoms"]) {
    if (geom.value("collision", false)) continue;
    const int body = geom["body"];
    auto [entity, is_new] = entities.emplace(body, Json());
    if (is_new) {
      const std::string name = head["bodies"][body]["name"];
      entity->second = {{"timestamp", TimeJson(0)},
                        {"frame_id", body == 0      ? "world"
                                     : name.empty() ? "body " + std::to_string(body)
                                                    : name},
                        {"id", "body " + std::to_string(body)},
                        {"lifetime", TimeJson(0)},
                        {"frame_locked", true},
                        {"metadata", Json::array()},
                        {"arrows", Json::array()},
                        {"cubes", Json::array()},
                        {"spheres", Json::array()},
                        {"cylinders", Json::array()},
                        {"lines", Json::array()},
                        {"triangles", Json::array()},
                        {"texts", Json::array()},
                        {"models", Json::array()}};
    }
    const Json& rgba =
        geom.contains("rgba") ? geom["rgba"] : head["materials"][geom["material"].get<int>()]["rgba"];
    AddGeom(geom, ColorJson(rgba), scene, &entity->second);
  }
  Json list = Json::array();
  for (auto& [body, entity] : entities) list.push_back(std::move(entity));
  return list;
}

}  // namespace evalbus::exports
