// Faces of a mesh file that MuJoCo 2.2 refuses.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace evalbus::mjcf {

// A mesh as MJCF's <mesh> contains it: coordinates of one vertex after the other, and three vertices per
// face.
struct MeshFaces {
  std::vector<double> vertex, texcoord;
  std::vector<double> face;
};

// MuJoCo 2.2 computes no inertia of a mesh in which two faces pass an edge in the same direction. Newer
// versions do, from the absolute volumes. If the OBJ file is such a mesh, returns it with separate vertices
// for each face: it has the same shape, hull and inertia, but no edge belongs to two faces. Empty for other
// meshes, also for files that cannot be read, which MuJoCo reports.
std::optional<MeshFaces> SeparateFaces(const std::filesystem::path& obj_file);

}  // namespace evalbus::mjcf
