#include "viz/images/painter/scene_shaders.h"

#include <fmt/format.h>

#include <string>
#include <utility>

namespace evalbus::viz {
namespace {

// Per-vertex lighting of OpenGL's fixed-function pipeline. `plain` is the sum over the lights without a
// shadow, and `shaded` is the contribution of the light with a shadow. LIGHTS, SHADOWS, TEXEL and one of the
// texture macros are prepended as #defines.
constexpr char kVertexShader[] = R"(
uniform vec3 light_direction[LIGHTS + 1], light_ambient[LIGHTS + 1], light_diffuse[LIGHTS + 1],
    light_specular[LIGHTS + 1];
uniform vec3 material;  // emission, specular, shininess
uniform vec4 plane_s, plane_t, plane_r;
uniform mat4 shadow_from_eye;
uniform vec3 floor_size;
varying vec4 plain;
varying vec3 shaded, shadow, place;
varying vec2 from_center;

vec3 Light(int i, vec3 normal, vec3 to_eye) {
  vec3 direction = light_direction[i];
  vec3 light = (light_ambient[i] + max(dot(normal, direction), 0.0) * light_diffuse[i]) * gl_Color.rgb;
  if (dot(normal, direction) > 0.0 && material.y > 0.0) {
    light += material.y * pow(max(dot(normal, normalize(direction + to_eye)), 0.0), material.z) * light_specular[i];
  }
  return light;
}

void main() {
  gl_Position = gl_ModelViewProjectionMatrix * gl_Vertex;
#ifdef SKY
  plain = vec4(1.0);
#else
  vec4 eye = gl_ModelViewMatrix * gl_Vertex;
  vec3 normal = normalize(gl_NormalMatrix * gl_Normal), to_eye = -normalize(eye.xyz);
  vec3 sum = material.x * gl_Color.rgb;
  for (int i = 0; i < LIGHTS; ++i) sum += Light(i, normal, to_eye);
  plain = vec4(clamp(sum, 0.0, 1.0), gl_Color.a);
#ifdef SHADOWS
  shaded = clamp(Light(LIGHTS, normal, to_eye), 0.0, 1.0);
  shadow = (shadow_from_eye * eye).xyz;
#endif
#endif
#ifdef FLOOR
  from_center = gl_Vertex.xy / floor_size.xy;
#endif
#ifdef EXPLICIT
  place = gl_MultiTexCoord0.xyz;
#else
  place = vec3(dot(plane_s, gl_Vertex), dot(plane_t, gl_Vertex), dot(plane_r, gl_Vertex));
#endif
}
)";

constexpr char kFragmentShader[] = R"(
uniform sampler2D flat_texture;
uniform samplerCube cube_texture;
uniform sampler2DShadow shadow_map;
varying vec4 plain;
varying vec3 shaded, shadow, place;
varying vec2 from_center;

// Share of the light that arrives, 0 to 1.
float Lit() {
#ifdef TEXEL
  // Each lookup interpolates between four texels. Two of them cost half of four and look nearly the same.
  return 0.5 * (shadow2D(shadow_map, shadow + TEXEL * vec3(-0.6, 0.3, 0.0)).r +
                shadow2D(shadow_map, shadow + TEXEL * vec3(0.6, -0.3, 0.0)).r);
#else
  return step(0.99, shadow2D(shadow_map, shadow).r);
#endif
}

void main() {
  vec4 color = plain;
#ifdef SHADOWS
  color.rgb += Lit() * shaded;
#endif
#ifdef FLOOR
  color.rgb = mix(color.rgb, textureCube(cube_texture, place).rgb, smoothstep(0.6, 1.0, length(from_center)));
#endif
#if defined(FLAT) || defined(EXPLICIT)
  color *= texture2D(flat_texture, place.xy);
#elif defined(CUBE) || defined(SKY)
  color *= textureCube(cube_texture, place);
#endif
  gl_FragColor = color;
}
)";

GLuint Compile(const GlFunctions& gl, GLenum type, const std::string& text) {
  const GLuint shader = gl.CreateShader(type);
  const char* source = text.c_str();
  gl.ShaderSource(shader, 1, &source, nullptr);
  gl.CompileShader(shader);
  return shader;
}

GLuint Link(const GlFunctions& gl, const std::string& vertex_shader, const std::string& fragment_shader) {
  const GLuint program = gl.CreateProgram();
  for (const GLuint shader :
       {Compile(gl, GL_VERTEX_SHADER, vertex_shader), Compile(gl, GL_FRAGMENT_SHADER, fragment_shader)}) {
    gl.AttachShader(program, shader);
    gl.DeleteShader(shader);
  }
  gl.LinkProgram(program);
  GLint is_linked = 0;
  gl.GetProgramiv(program, GL_LINK_STATUS, &is_linked);
  if (!is_linked) {
    char log[300] = "";
    gl.GetProgramInfoLog(program, sizeof log, nullptr, log);
    throw EnvironmentError(std::string("this OpenGL implementation cannot compile the shaders: ") + log);
  }
  return program;
}

}  // namespace

SceneShaders::~SceneShaders() {
  for (const auto& [key, program] : programs_) gl_.DeleteProgram(program.id);
}

void SceneShaders::SetLights(SceneLights lights) {
  lights_ = std::move(lights);
  for (auto& [key, program] : programs_) program.knows_lights = false;
}

const SceneShaders::Program& SceneShaders::Use(Texture texture, bool with_shadow) {
  const int lights = static_cast<int>(lights_.direction.size()) - (with_shadow ? 1 : 0);
  const auto key = std::tuple(texture, with_shadow, lights);
  auto found = programs_.find(key);
  if (found == programs_.end()) found = programs_.emplace(key, Make(texture, with_shadow, lights)).first;
  Program& program = found->second;
  if (in_use_ != program.id) gl_.UseProgram(in_use_ = program.id);
  if (!program.knows_lights) {
    const auto count = static_cast<GLsizei>(lights_.direction.size());
    gl_.Uniform3fv(program.light_direction, count, &lights_.direction[0].x);
    gl_.Uniform3fv(program.light_ambient, count, &lights_.ambient[0].x);
    gl_.Uniform3fv(program.light_diffuse, count, &lights_.diffuse[0].x);
    gl_.Uniform3fv(program.light_specular, count, &lights_.specular[0].x);
    gl_.UniformMatrix4fv(program.shadow_from_eye, 1, GL_FALSE, lights_.shadow_from_eye.data());
    program.knows_lights = true;
  }
  return program;
}

void SceneShaders::Release() { gl_.UseProgram(in_use_ = 0); }

SceneShaders::Program SceneShaders::Make(Texture texture, bool with_shadow, int lights) {
  static constexpr const char* kNames[] = {"PLAIN", "FLAT", "EXPLICIT", "CUBE", "SKY", "FLOOR"};
  const std::string head =
      fmt::format("#version 120\n#define LIGHTS {}\n#define {}\n{}", lights,
                  kNames[static_cast<int>(texture)], with_shadow ? "#define SHADOWS\n" : "") +
      (soft_shadow_size_ > 0 ? fmt::format("#define TEXEL (1.0 / {}.0)\n", soft_shadow_size_) : "");
  Program program{};
  program.id = Link(gl_, head + kVertexShader, head + kFragmentShader);
  const auto find = [&](const char* name) { return gl_.GetUniformLocation(program.id, name); };
  program.plane_s = find("plane_s");
  program.plane_t = find("plane_t");
  program.plane_r = find("plane_r");
  program.material = find("material");
  program.floor_size = find("floor_size");
  program.light_direction = find("light_direction");
  program.light_ambient = find("light_ambient");
  program.light_diffuse = find("light_diffuse");
  program.light_specular = find("light_specular");
  program.shadow_from_eye = find("shadow_from_eye");
  gl_.UseProgram(in_use_ = program.id);
  gl_.Uniform1i(find("flat_texture"), 0);
  gl_.Uniform1i(find("cube_texture"), 0);
  gl_.Uniform1i(find("shadow_map"), 1);
  return program;
}

}  // namespace evalbus::viz
