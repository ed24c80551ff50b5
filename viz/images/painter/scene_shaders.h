// Shader programs that reproduce the lighting and texturing of OpenGL's fixed-function pipeline in one pass,
// including the shadow of one light.
#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "viz/images/painter/gl_functions.h"
#include "viz/images/painter/gl_math.h"

namespace evalbus::viz {

// Source of a vertex's color and texture coordinates. Each source has its own program. kFloor: an untextured
// floor whose edge fades into the sky. The texture of the sky must be bound.
enum class Texture { kNone, kFlat, kExplicit, kCube, kSky, kFloor };

// All lights are directional; `direction` points toward the light, in the eye frame.
struct SceneLights {
  std::vector<Vec> direction, ambient, diffuse, specular;
  // Transforms points from the eye frame to shadow map coordinates, which are from 0 to 1.
  Matrix shadow_from_eye{};
};

class SceneShaders {
 public:
  struct Program {
    GLuint id;
    // plane_s, plane_t, plane_r: texture coordinate generation planes. material: emission, specular,
    // shininess.
    GLint plane_s, plane_t, plane_r, material;
    // Half the size of a floor.
    GLint floor_size;
    GLint light_direction, light_ambient, light_diffuse, light_specular, shadow_from_eye;
    bool knows_lights = false;
  };

  // soft_shadow_size: width of the shadow map in texels, for shadows with soft edges; 0: hard shadows.
  SceneShaders(const GlFunctions& gl, int soft_shadow_size) : gl_(gl), soft_shadow_size_(soft_shadow_size) {}
  ~SceneShaders();
  SceneShaders(const SceneShaders&) = delete;
  SceneShaders& operator=(const SceneShaders&) = delete;

  // Sets the lights for subsequent drawing.
  void SetLights(SceneLights lights);
  // Activates the program. with_shadow: whether the last light casts a shadow, which is read from the shadow
  // map in texture unit 1. Throws EnvironmentError if OpenGL fails to compile or link it.
  const Program& Use(Texture texture, bool with_shadow);
  // Deactivates the current program.
  void Release();

 private:
  Program Make(Texture texture, bool with_shadow, int lights);

  const GlFunctions& gl_;
  const int soft_shadow_size_;
  std::map<std::tuple<Texture, bool, int>, Program> programs_;
  SceneLights lights_;
  GLuint in_use_ = 0;
};

}  // namespace evalbus::viz
