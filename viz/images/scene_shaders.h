// The programs that light and color a scene: OpenGL's fixed functions in one pass, with the shadow of one
// light looked up on the way.
#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "viz/images/gl_functions.h"
#include "viz/images/gl_math.h"

namespace evalbus::viz {

// What a vertex is colored by; each makes its own program.
enum class Texture { kNone, kFlat, kExplicit, kCube, kSky };

// All directional; a light's direction is toward it, as seen from the eye.
struct SceneLights {
  std::vector<Vec> direction, ambient, diffuse, specular;
  // From the eye's place of a point to its place in the map, each coordinate from 0 to 1.
  Matrix shadow_from_eye{};
};

class SceneShaders {
 public:
  struct Program {
    GLuint id;
    // What the fixed functions call planes for texture coordinates; emission, specular and shininess.
    GLint plane_s, plane_t, plane_r, material;
    GLint light_direction, light_ambient, light_diffuse, light_specular, shadow_from_eye;
    bool knows_lights = false;
  };

  explicit SceneShaders(const GlFunctions& gl) : gl_(gl) {}
  ~SceneShaders();
  SceneShaders(const SceneShaders&) = delete;
  SceneShaders& operator=(const SceneShaders&) = delete;

  // Of what is drawn from now on.
  void SetLights(SceneLights lights);
  // The program is in use from now on. with_shadow: the last light has one, in the map of texture unit 1;
  // without, it is a light as the others. Throws EnvironmentError if OpenGL refuses it.
  const Program& Use(Texture texture, bool with_shadow);
  // None of them is.
  void Release();

 private:
  Program Make(Texture texture, bool with_shadow, int lights);

  const GlFunctions& gl_;
  std::map<std::tuple<Texture, bool, int>, Program> programs_;
  SceneLights lights_;
  GLuint in_use_ = 0;
};

}  // namespace evalbus::viz
