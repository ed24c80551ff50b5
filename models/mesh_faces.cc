#include "models/mesh_faces.h"

#include <tiny_obj_loader.h>

#include <set>
#include <utility>

namespace evalbus::mjcf {

std::optional<MeshFaces> SeparateFaces(const std::filesystem::path& obj_file) {
  tinyobj::ObjReader reader;
  if (!reader.ParseFromFile(obj_file.string())) return std::nullopt;
  MeshFaces mesh;
  std::set<std::pair<int, int>> edges;
  bool is_consistent = true;
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    const std::vector<tinyobj::index_t>& corners = shape.mesh.indices;
    for (size_t i = 0; i < corners.size(); ++i) {
      const tinyobj::index_t& corner = corners[i];
      const size_t next = i % 3 == 2 ? i - 2 : i + 1;
      is_consistent &= edges.emplace(corner.vertex_index, corners[next].vertex_index).second;
      mesh.face.push_back(static_cast<double>(mesh.face.size()));
      for (int axis = 0; axis < 3; ++axis)
        mesh.vertex.push_back(reader.GetAttrib().vertices[3 * static_cast<size_t>(corner.vertex_index) +
                                                          static_cast<size_t>(axis)]);
      if (corner.texcoord_index < 0) continue;
      const float* texcoord = &reader.GetAttrib().texcoords[2 * static_cast<size_t>(corner.texcoord_index)];
      // Texture coordinates count from the bottom of the image in OBJ files, but from the top in MJCF.
      mesh.texcoord.insert(mesh.texcoord.end(), {texcoord[0], 1 - texcoord[1]});
    }
  }
  if (is_consistent) return std::nullopt;
  // Either all vertices or none must have texture coordinates.
  if (mesh.texcoord.size() / 2 != mesh.face.size()) mesh.texcoord.clear();
  return mesh;
}

}  // namespace evalbus::mjcf
