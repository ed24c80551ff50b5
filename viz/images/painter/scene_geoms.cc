#include "viz/images/painter/scene_geoms.h"

namespace evalbus::viz {
namespace {

// Display lists of MuJoCo's built-in shapes, counted from mjrContext::baseBuiltin. MuJoCo does not document
// this order, so a test compares each shape with the output of mjr_render.
enum Shape { kSphere, kSphereTop, kSphereBottom, kCylinder, kOpenCylinder, kHaze, kBox, kCone, kNumShapes };

}  // namespace

bool SceneGeoms::Supports(const mjrContext& context) { return context.rangeBuiltin == kNumShapes; }

void SceneGeoms::Draw(const mjvGeom& geom) const {
  const float* r = geom.mat;
  const float* size = geom.size;
  const float place[16] = {r[0], r[3], r[6], 0, r[1],        r[4],        r[7],        0,
                           r[2], r[5], r[8], 0, geom.pos[0], geom.pos[1], geom.pos[2], 1};
  gl_.PushMatrix();
  gl_.MultMatrixf(place);
  const auto data = static_cast<GLuint>(geom.dataid);
  switch (geom.type) {
    case mjGEOM_PLANE:
      if (geom.dataid < 0) gl_.Scalef(size[0], size[1], 1);
      gl_.CallList(context_.basePlane + (geom.dataid < 0 ? 0 : data + 1));
      break;
    case mjGEOM_HFIELD:
      gl_.CallList(context_.baseHField + data);
      break;
    case mjGEOM_MESH:
      gl_.CallList(context_.baseMesh + data);
      break;
    case mjGEOM_CAPSULE: {
      const float radius = 0.5f * (size[0] + size[1]);
      gl_.Scalef(size[0], size[1], size[2]);
      gl_.CallList(context_.baseBuiltin + kOpenCylinder);
      // In these lists, the cap centers are one radius above and below the origin.
      gl_.Scalef(1, 1, radius / size[2]);
      gl_.Translatef(0, 0, (size[2] - radius) / radius);
      gl_.CallList(context_.baseBuiltin + kSphereTop);
      gl_.Translatef(0, 0, 2 * (radius - size[2]) / radius);
      gl_.CallList(context_.baseBuiltin + kSphereBottom);
      break;
    }
    default:
      gl_.Scalef(size[0], size[1], size[2]);
      gl_.CallList(context_.baseBuiltin + (geom.type == mjGEOM_BOX        ? kBox
                                           : geom.type == mjGEOM_CYLINDER ? kCylinder
                                                                          : kSphere));
  }
  gl_.PopMatrix();
}

void SceneGeoms::DrawSky(Vec place, float distance) const {
  gl_.PushMatrix();
  gl_.Translatef(place.x, place.y, place.z);
  gl_.Scalef(distance, distance, distance);
  gl_.CallList(context_.baseBuiltin + kCylinder);
  gl_.PopMatrix();
}

}  // namespace evalbus::viz
