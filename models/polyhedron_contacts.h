// Contacts between boxes and hulls of meshes, as MuJoCo 3.3 computes them.
#pragma once

#include <mujoco/mujoco.h>

namespace evalbus {

// Name of the number in <custom> that a scene needs for these contacts.
inline constexpr const char* kPolyhedronContacts = "polyhedron_contacts";

// For a pair of a box and a mesh, or of two meshes, some of MuJoCo 2.2's contact normals are turned by up to
// 60 degrees. In scenes that have the number kPolyhedronContacts, such a pair gets the direction in which the
// smallest movement separates it, and up to four contacts where a face or an edge lies on a face. Two boxes
// keep 2.2's contacts without those that 3.3 has removed, which lie outside one of the boxes. Pairs with a
// margin keep MuJoCo's contacts. Must not be called while another thread computes contacts.
void InstallPolyhedronContacts();

// Lets each mjData of a scene with kPolyhedronContacts remember how far apart its geoms are, in
// mjData.userdata. The contacts are the same, and are found faster. Sizes and margins of geoms must not be
// changed after that.
void ReserveKnownGaps(mjModel* model);

}  // namespace evalbus
