// Contacts between boxes and hulls of meshes, as MuJoCo 3.3 computes them.
#pragma once

#include <mujoco/mujoco.h>

namespace evalbus {

// Name of the number in <custom> that a scene needs for these contacts.
inline constexpr const char* kPolyhedronContacts = "polyhedron_contacts";

// Replaces MuJoCo 2.2's contact functions. For a pair of a box and a mesh, or of two meshes, some of the
// contact normals of 2.2 are wrong by up to 60 degrees. In scenes that have the number kPolyhedronContacts,
// the normal of such a pair becomes the direction in which the smallest movement separates it. Where a face
// or an edge lies on a face, the pair gets up to four contacts. Two boxes keep 2.2's contacts, except
// contacts outside one of the boxes, which 3.3 does not report. Pairs with a margin keep MuJoCo's contacts.
// Must not be called while another thread computes contacts.
void InstallPolyhedronContacts();

// Reserves memory in mjData.userdata of a scene with kPolyhedronContacts, in which the distances of its geoms
// are cached. The contacts are the same, and are found faster. Sizes and margins of geoms must not be changed
// after that.
void ReserveKnownGaps(mjModel* model);

}  // namespace evalbus
