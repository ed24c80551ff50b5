// Repairs meshes that MuJoCo 2.2 refuses because of their faces.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace evalbus::mjcf {

// A mesh in the form of MJCF's <mesh>: coordinates of one vertex after the other, and three vertex indices
// per face.
struct MeshFaces {
  std::vector<double> vertex, texcoord;
  std::vector<double> face;
};

// MuJoCo 2.2 refuses to compute the inertia of a mesh in which two faces pass an edge in the same direction.
// Newer versions compute it from the absolute volumes. If the OBJ file contains such a mesh, returns it with
// separate vertices for each face. It then has the same shape, hull and inertia, but no edge belongs to two
// faces. Returns nullopt for other meshes, and for files that cannot be read, because MuJoCo reports those.
std::optional<MeshFaces> SeparateFaces(const std::filesystem::path& obj_file);

}  // namespace evalbus::mjcf
