#include "viz/viewer/scene_blocks.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "base/errors.h"
#include "base/sha256.h"
#include "models/physics_model.h"
#include "models/randomized_model.h"
#include "models/task_description.h"
#include "viz/viewer/block.h"

namespace evalbus::viz {
namespace {

using Json = nlohmann::ordered_json;

// MuJoCo shows geom groups 0 to 2 by default.
constexpr int kShownGroups = 3;

template <class T>
Json List(const T* values, int count) {
  Json list = Json::array();
  // Writes the shortest decimal number that gives the same float, not all digits of the number as a double.
  for (int i = 0; i < count; ++i) {
    if constexpr (std::is_same_v<T, float>) {
      list.push_back(std::stod(fmt::format("{}", values[i])));
    } else {
      list.push_back(values[i]);
    }
  }
  return list;
}

Json ListAt(const float* values, int index, int count) { return List(values + count * index, count); }
Json ListAt(const mjtNum* values, int index, int count) { return List(values + count * index, count); }

const char* ShapeName(int type) {
  switch (type) {
    case mjGEOM_PLANE:
      return "plane";
    case mjGEOM_SPHERE:
      return "sphere";
    case mjGEOM_CAPSULE:
      return "capsule";
    case mjGEOM_ELLIPSOID:
      return "ellipsoid";
    case mjGEOM_CYLINDER:
      return "cylinder";
    case mjGEOM_BOX:
      return "box";
    case mjGEOM_MESH:
      return "mesh";
    default:
      throw InputError(fmt::format("geoms of MuJoCo's type {} are not supported", type));
  }
}

// Collects triangle corners. Corners that are identical after quantization are stored once.
class MeshBuilder {
 public:
  MeshBuilder(const float* vertex, size_t count) {
    for (size_t axis = 0; axis < 3; ++axis) {
      double low = 0, high = 0;
      for (size_t i = 0; i < count; ++i) {
        const double value = vertex[3 * i + axis];
        low = i == 0 ? value : std::min(low, value);
        high = i == 0 ? value : std::max(high, value);
      }
      origin_[axis] = low;
      scale_[axis] = high > low ? (high - low) / 65535 : 1;
    }
  }

  // normal and uv may be null.
  void AddCorner(const float* vertex, const float* normal, const float* uv) {
    Corner corner{};
    for (size_t axis = 0; axis < 3; ++axis) {
      corner.vertex[axis] = static_cast<uint16_t>(std::lround((vertex[axis] - origin_[axis]) / scale_[axis]));
      if (normal) corner.normal[axis] = static_cast<int16_t>(std::lround(normal[axis] * 32767));
    }
    if (uv) corner.uv = {uv[0], uv[1]};
    has_normals_ |= normal != nullptr;
    has_uv_ |= uv != nullptr;
    const auto [place, is_new] = index_.emplace(corner, static_cast<uint32_t>(corners_.size()));
    if (is_new) corners_.push_back(corner);
    faces_.push_back(place->second);
  }

  std::string Bytes() const {
    BlockWriter block("mesh");
    std::vector<uint16_t> vertices;
    std::vector<int16_t> normals;
    std::vector<float> uv;
    for (const Corner& corner : corners_) {
      vertices.insert(vertices.end(), corner.vertex.begin(), corner.vertex.end());
      normals.insert(normals.end(), corner.normal.begin(), corner.normal.end());
      uv.insert(uv.end(), corner.uv.begin(), corner.uv.end());
    }
    Json& array = block.Add("vertices_m", {corners_.size(), 3}, vertices);
    array["scale"] = scale_;
    array["origin"] = origin_;
    if (has_normals_) block.Add("normals", {corners_.size(), 3}, normals)["scale"] = 1.0 / 32767;
    if (corners_.size() <= 65536) {
      block.Add("faces", {faces_.size() / 3, 3}, std::vector<uint16_t>(faces_.begin(), faces_.end()));
    } else {
      block.Add("faces", {faces_.size() / 3, 3}, faces_);
    }
    if (has_uv_) block.Add("uv", {corners_.size(), 2}, uv);
    return block.Bytes();
  }

 private:
  struct Corner {
    std::array<uint16_t, 3> vertex;
    std::array<int16_t, 3> normal;
    std::array<float, 2> uv;
    auto operator<=>(const Corner&) const = default;
  };
  std::array<double, 3> origin_{}, scale_{};
  std::map<Corner, uint32_t> index_;
  std::vector<Corner> corners_;
  std::vector<uint32_t> faces_;
  bool has_normals_ = false, has_uv_ = false;
};

// Returns a block with the rendered form of the mesh.
std::string VisualMesh(const mjModel& m, int mesh) {
  const float* vertex = m.mesh_vert + 3 * m.mesh_vertadr[mesh];
  const float* normal = m.mesh_normal + 3 * m.mesh_vertadr[mesh];
  const float* uv = m.mesh_texcoordadr[mesh] < 0 ? nullptr : m.mesh_texcoord + 2 * m.mesh_texcoordadr[mesh];
  MeshBuilder builder(vertex, static_cast<size_t>(m.mesh_vertnum[mesh]));
  const int* face = m.mesh_face + 3 * m.mesh_faceadr[mesh];
  for (int i = 0; i < 3 * m.mesh_facenum[mesh]; ++i) {
    const int corner = face[i];
    builder.AddCorner(vertex + 3 * corner, normal + 3 * corner, uv ? uv + 2 * corner : nullptr);
  }
  return builder.Bytes();
}

// Returns a block of the mesh's convex hull, which MuJoCo uses for collisions, or of the visual mesh if the
// model has no hull for it. A hull has no normals, because its faces are flat. Layout of mesh_graph: numvert,
// numface, vert_edgeadr[numvert], vert_globalid[numvert], edge_localid[numvert + 3 numface], face_globalid[3
// numface].
std::string HullMesh(const mjModel& m, int mesh) {
  if (m.mesh_graphadr[mesh] < 0) return VisualMesh(m, mesh);
  const int* graph = m.mesh_graph + m.mesh_graphadr[mesh];
  const int num_corners = graph[0], num_faces = graph[1];
  const int* face = graph + 2 + 3 * num_corners + 3 * num_faces;
  const float* vertex = m.mesh_vert + 3 * m.mesh_vertadr[mesh];
  MeshBuilder builder(vertex, static_cast<size_t>(m.mesh_vertnum[mesh]));
  for (int i = 0; i < 3 * num_faces; ++i) builder.AddCorner(vertex + 3 * face[i], nullptr, nullptr);
  return builder.Bytes();
}

std::string Png(const mjtByte* rgb, int width, int height) {
  const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), cairo_surface_destroy);
  uint8_t* pixels = cairo_image_surface_get_data(surface.get());
  if (!pixels) throw InputError("a texture has an invalid size");
  const size_t stride = static_cast<size_t>(cairo_image_surface_get_stride(surface.get()));
  for (size_t row = 0; row < static_cast<size_t>(height); ++row) {
    for (size_t column = 0; column < static_cast<size_t>(width); ++column, rgb += 3) {
      const uint32_t pixel = uint32_t{rgb[0]} << 16 | uint32_t{rgb[1]} << 8 | rgb[2];
      std::memcpy(pixels + row * stride + 4 * column, &pixel, sizeof pixel);
    }
  }
  cairo_surface_mark_dirty(surface.get());
  std::string png;
  cairo_surface_write_to_png_stream(
      surface.get(),
      [](void* text, const unsigned char* data, unsigned length) {
        static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(data), length);
        return CAIRO_STATUS_SUCCESS;
      },
      &png);
  return png;
}

std::string Texture(const mjModel& m, int texture) {
  BlockWriter block("texture");
  const int width = m.tex_width[texture], height = m.tex_height[texture];
  block.head()["type"] = m.tex_type[texture] == mjTEXTURE_2D ? "2d" : "cube";
  block.head()["size"] = {width, height};
  const std::string png = Png(m.tex_rgb + m.tex_adr[texture], width, height);
  block.Add("png", {png.size()}, std::vector<uint8_t>(png.begin(), png.end()));
  return block.Bytes();
}

// Returns the mean colors of the upper and lower faces of the skybox (the third and fourth of its six faces).
Json Sky(const mjModel& m) {
  for (int texture = 0; texture < m.ntex; ++texture) {
    if (m.tex_type[texture] != mjTEXTURE_SKYBOX) continue;
    const int width = m.tex_width[texture];
    if (m.tex_height[texture] != 6 * width) continue;
    const auto mean = [&](int face) {
      const mjtByte* rgb = m.tex_rgb + m.tex_adr[texture] + 3 * face * width * width;
      Json color = Json::array();
      for (int c = 0; c < 3; ++c) {
        int64_t sum = 0;
        for (int i = 0; i < width * width; ++i) sum += rgb[3 * i + c];
        color.push_back(static_cast<double>(sum) / (255.0 * width * width));
      }
      return color;
    };
    return {{"above", mean(2)}, {"below", mean(3)}};
  }
  return nullptr;
}

Json Light(const mjModel& m, int id) {
  return {
      {"name", m.names + m.name_lightadr[id]},         {"body", m.light_bodyid[id]},
      {"position_m", ListAt(m.light_pos, id, 3)},      {"direction", ListAt(m.light_dir, id, 3)},
      {"directional", m.light_directional[id] != 0},   {"shadow", m.light_castshadow[id] != 0},
      {"diffuse", ListAt(m.light_diffuse, id, 3)},     {"specular", ListAt(m.light_specular, id, 3)},
      {"ambient", ListAt(m.light_ambient, id, 3)},     {"attenuation", ListAt(m.light_attenuation, id, 3)},
      {"cutoff_deg", List(m.light_cutoff + id, 1)[0]}, {"exponent", List(m.light_exponent + id, 1)[0]}};
}

Json Camera(const mjModel& m, int id) {
  return {{"name", m.names + m.name_camadr[id]},
          {"body", m.cam_bodyid[id]},
          {"position_m", ListAt(m.cam_pos, id, 3)},
          {"quat_wxyz", ListAt(m.cam_quat, id, 4)},
          {"fovy_deg", m.cam_fovy[id]}};
}

// Returns whether a geom's own color is used. As in MuJoCo, this is the case if it differs from the default
// or if the geom has no material.
bool HasOwnColor(const mjModel& m, int geom) {
  const float* rgba = m.geom_rgba + 4 * geom;
  return m.geom_matid[geom] < 0 || rgba[0] != 0.5F || rgba[1] != 0.5F || rgba[2] != 0.5F || rgba[3] != 1;
}

Json Geom(const mjModel& m, int id) {
  const int type = m.geom_type[id];
  Json geom = {{"body", m.geom_bodyid[id]},
               {"position_m", ListAt(m.geom_pos, id, 3)},
               {"quat_wxyz", ListAt(m.geom_quat, id, 4)},
               {"shape", ShapeName(type)}};
  if (type != mjGEOM_MESH) geom["size_m"] = ListAt(m.geom_size, id, 3);
  if (HasOwnColor(m, id)) geom["rgba"] = ListAt(m.geom_rgba, id, 4);
  return geom;
}

bool IsShown(const mjModel& m, int geom) {
  if (m.geom_group[geom] >= kShownGroups) return false;
  const float* rgba = HasOwnColor(m, geom) ? m.geom_rgba + 4 * geom : m.mat_rgba + 4 * m.geom_matid[geom];
  return rgba[3] > 0;
}

bool IsFixed(const mjModel& m, int body) {
  for (; body != 0; body = m.body_parentid[body]) {
    if (m.body_jntnum[body] > 0 || m.body_mocapid[body] >= 0) return false;
  }
  return true;
}

// Returns the differing entries of two lists, as [index, {key: value}].
Json Differences(const Json& before, const Json& after) {
  Json differences = Json::array();
  for (size_t i = 0; i < before.size(); ++i) {
    Json changed = Json::object();
    for (const auto& [key, value] : after[i].items()) {
      if (before[i].value(key, Json()) != value) changed[key] = value;
    }
    if (!changed.empty()) differences.push_back({i, changed});
  }
  return differences;
}

template <class Make>
Json ListOf(int count, const Make& make) {
  Json list = Json::array();
  for (int i = 0; i < count; ++i) list.push_back(make(i));
  return list;
}

}  // namespace

SceneBlocks::SceneBlocks(const model_info_t& info)
    : SceneBlocks(info, LoadVisualModel(info), *LoadPhysicsModel(info)) {}

SceneBlocks::SceneBlocks(const model_info_t& info, ModelPtr visual, const mjModel& physics)
    : info_(info), visual_(std::move(visual)) {
  if (visual_->nbody != info_.num_bodies || physics.nbody != info_.num_bodies ||
      physics.ngeom != info_.num_geoms) {
    throw InputError("the bodies or geoms in MODEL differ from those in the model files");
  }
  MakeScene(physics);
}

Json SceneBlocks::Material(const mjModel& m, int id) const {
  const auto texture = textures_.find(m.mat_texid[id]);
  return {{"rgba", ListAt(m.mat_rgba, id, 4)},
          {"specular", List(m.mat_specular + id, 1)[0]},
          {"shininess", List(m.mat_shininess + id, 1)[0]},
          {"emission", List(m.mat_emission + id, 1)[0]},
          {"reflectance", List(m.mat_reflectance + id, 1)[0]},
          {"texture", texture == textures_.end() ? Json() : Json(texture->second)},
          {"repeat", ListAt(m.mat_texrepeat, id, 2)},
          {"uniform", m.mat_texuniform[id] != 0}};
}

void SceneBlocks::MakeScene(const mjModel& physics) {
  const mjModel& m = *visual_;
  const auto add = [this](std::string bytes) {
    std::string id = Sha256Text(bytes);
    blocks_.emplace(id, std::move(bytes));
    return id;
  };

  BlockWriter block("scene");
  Json& head = block.head();
  head["task"] = info_.task;
  head["robot"] = info_.robot;

  const DataPtr data(mj_makeData(&m));
  mj_kinematics(&m, data.get());
  Json& bodies = head["bodies"] = Json::array();
  for (int body = 0; body < m.nbody; ++body) {
    const bool is_fixed = IsFixed(m, body);
    if (!is_fixed) moving_.push_back(body);
    Json& json = bodies.emplace_back(
        Json{{"name", info_.body_name[body]}, {"entity", info_.body_entity[body]}, {"moves", !is_fixed}});
    if (!is_fixed) continue;
    json["position_m"] = ListAt(data->xpos, body, 3);
    json["quat_wxyz"] = ListAt(data->xquat, body, 4);
  }

  constexpr const char* kKinds[] = {"world", "robot", "object", "fixture"};
  Json& entities = head["entities"] = Json::array();
  for (int entity = 0; entity < info_.num_entities; ++entity) {
    const auto kind = std::clamp<int>(info_.entity_kind[entity], 0, std::size(kKinds) - 1);
    Json& json = entities.emplace_back(Json{{"name", info_.entity_name[entity]}, {"kind", kKinds[kind]}});
    const auto object = std::ranges::find(info_.object_entity, entity);
    if (object != info_.object_entity.end()) json["object"] = object - info_.object_entity.begin();
  }

  Json& wrists = head["wrists"] = Json::array();
  for (const arm_info_t& arm : info_.arm) {
    const int site = mj_name2id(&m, mjOBJ_SITE, arm.wrist_site.c_str());
    if (site < 0) continue;
    wrists.push_back(
        {{"arm", arm.name}, {"body", m.site_bodyid[site]}, {"position_m", ListAt(m.site_pos, site, 3)}});
  }

  std::map<int, std::string> meshes, hulls;
  Json& geoms = head["geoms"] = Json::array();
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (!IsShown(m, geom)) continue;
    Json& json = geoms.emplace_back(Geom(m, geom));
    if (m.geom_matid[geom] >= 0) json["material"] = m.geom_matid[geom];
    if (m.geom_type[geom] != mjGEOM_MESH) continue;
    const int mesh = m.geom_dataid[geom];
    if (!meshes.contains(mesh)) meshes[mesh] = add(VisualMesh(m, mesh));
    json["mesh"] = meshes[mesh];
  }
  for (int geom = 0; geom < physics.ngeom; ++geom) {
    Json& json = geoms.emplace_back(Geom(physics, geom));
    json["collision"] = true;
    json["geom"] = geom;
    json["name"] = info_.geom_name[geom];
    if (physics.geom_type[geom] != mjGEOM_MESH) continue;
    const int mesh = physics.geom_dataid[geom];
    if (!hulls.contains(mesh)) hulls[mesh] = add(HullMesh(physics, mesh));
    json["mesh"] = hulls[mesh];
  }

  const auto add_texture = [&](int id) {
    if (id >= 0 && !textures_.contains(id)) textures_[id] = add(Texture(m, id));
  };
  for (int id = 0; id < m.nmat; ++id) add_texture(m.mat_texid[id]);
  std::vector<int> choices;
  if (!info_.variation.empty()) {
    const TaskDescription task = ParseTask(info_.task_yaml, info_.task_file, false);
    choices = TexturesOf(task.variation(info_.variation), m);
  }
  for (const int id : choices) add_texture(id);
  head["materials"] = ListOf(m.nmat, [&](int id) { return Material(m, id); });
  if (!choices.empty()) head["textures"] = Json::array();
  for (const int id : choices) head["textures"].push_back(textures_[id]);
  Json& lights = head["lights"] = Json::array();
  for (int light = 0; light < m.nlight; ++light) {
    if (m.light_active[light]) lights.push_back(Light(m, light));
  }
  const auto& headlight = m.vis.headlight;
  head["headlight"] = nullptr;
  if (headlight.active) {
    head["headlight"] = {{"diffuse", List(headlight.diffuse, 3)},
                         {"specular", List(headlight.specular, 3)},
                         {"ambient", List(headlight.ambient, 3)}};
  }
  head["cameras"] = ListOf(m.ncam, [&](int id) { return Camera(m, id); });
  head["sky"] = Sky(m);
  head["extent_m"] = m.stat.extent;
  head["center_m"] = List(m.stat.center, 3);
  id_ = add(block.Bytes());
}

Json SceneBlocks::Appearance(int64_t seed) const {
  Json appearance = {{"materials", Json::array()},
                     {"geoms", Json::array()},
                     {"lights", Json::array()},
                     {"cameras", Json::array()}};
  const TaskDescription task = ParseTask(info_.task_yaml, info_.task_file, false);
  const Variation& variation = task.variation(info_.variation);
  if (variation.appearance.empty()) return appearance;
  const ModelPtr changed(mj_copyModel(nullptr, visual_.get()));
  RandomizeAppearance(variation, seed, changed.get());
  const mjModel &a = *visual_, &b = *changed;
  const auto differences = [&](int count, const auto& make) {
    return Differences(ListOf(count, [&](int id) { return make(a, id); }),
                       ListOf(count, [&](int id) { return make(b, id); }));
  };
  appearance["materials"] = differences(a.nmat, [this](const mjModel& m, int id) { return Material(m, id); });
  appearance["cameras"] = differences(a.ncam, Camera);
  // Lights and geoms are identified by their indices in the scene's lists, which contain neither inactive
  // lights nor invisible geoms.
  int place = 0;
  for (int light = 0; light < a.nlight; ++light) {
    if (!a.light_active[light]) continue;
    for (Json& difference : Differences(Json::array({Light(a, light)}), Json::array({Light(b, light)}))) {
      appearance["lights"].push_back({place, difference[1]});
    }
    ++place;
  }
  place = 0;
  for (int geom = 0; geom < a.ngeom; ++geom) {
    if (!IsShown(a, geom)) continue;
    const Json before = ListAt(a.geom_rgba, geom, 4), after = ListAt(b.geom_rgba, geom, 4);
    if (before != after) appearance["geoms"].push_back({place, Json{{"rgba", after}}});
    ++place;
  }
  return appearance;
}

}  // namespace evalbus::viz
