#include "viz/pictures/scene_painter.h"

#include <GL/gl.h>
#include <GL/glext.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/errors.h"
#include "viz/pictures/gl_context.h"

namespace evalbus::viz {
namespace {

// The lists of MuJoCo's built-in shapes, from mjrContext::baseBuiltin on. MuJoCo does not publish this order;
// a test compares each shape with mjr_render's.
enum Shape { kSphere, kSphereTop, kSphereBottom, kCylinder, kOpenCylinder, kHaze, kBox, kCone, kNumShapes };

// What a vertex is coloured by; each makes its own program.
enum class Texture { kNone, kFlat, kExplicit, kCube, kSky };

// The lights of OpenGL's fixed functions, at each vertex: those without a shadow in `plain`, that with one in
// `shaded`. LIGHTS, SHADOWS and one of the textures are defined in front.
constexpr char kVertexShader[] = R"(
uniform vec3 light_direction[LIGHTS + 1], light_ambient[LIGHTS + 1], light_diffuse[LIGHTS + 1],
    light_specular[LIGHTS + 1];
uniform vec3 material;  // emission, specular, shininess
uniform vec4 plane_s, plane_t, plane_r;
uniform mat4 shadow_from_eye;
varying vec4 plain;
varying vec3 shaded, shadow, place;

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

void main() {
  vec4 colour = plain;
#ifdef SHADOWS
  colour.rgb += step(0.99, shadow2D(shadow_map, shadow).r) * shaded;
#endif
#if defined(FLAT) || defined(EXPLICIT)
  colour *= texture2D(flat_texture, place.xy);
#elif defined(CUBE) || defined(SKY)
  colour *= textureCube(cube_texture, place);
#endif
  gl_FragColor = colour;
}
)";

// Where the shadow of something that moves falls on what does not, that picture without the light with a
// shadow.
constexpr char kShadowVertexShader[] = R"(#version 120
uniform mat4 shadow_from_clip;
varying vec4 nearest;
void main() {
  gl_Position = gl_Vertex;
  nearest = shadow_from_clip * vec4(gl_Vertex.xy, -1.0, 1.0);
}
)";
constexpr char kShadowFragmentShader[] = R"(#version 120
uniform sampler2D dark, depth;
uniform sampler2DShadow shadow_map;
uniform vec4 deeper;  // from the nearest that can be seen to the furthest
uniform vec2 buffer;
varying vec4 nearest;
void main() {
  vec2 here = gl_FragCoord.xy * buffer;
  vec4 shadow = nearest + texture2D(depth, here).r * deeper;
  if (shadow2D(shadow_map, shadow.xyz / shadow.w).r >= 0.99) discard;
  gl_FragColor = texture2D(dark, here);
}
)";

// A picture is searched for shadows of what moves by squares of so many pixels each way, and each body's
// shadow by so many steps along the light.
constexpr int kTile = 32, kSteps = 32;

// Pictures of what does not move that are kept.
constexpr size_t kMaxBackdrops = 8;

// The functions that are needed, by their names without "gl".
struct GlFunctions {
  GlFunctions() {
#define EVALBUS_LOAD(name)                                         \
  name = reinterpret_cast<decltype(name)>(GlFunction("gl" #name)); \
  if (!name) throw EnvironmentError("OpenGL has no gl" #name);
#define EVALBUS_GL(F)                                                                                   \
  F(Enable)                                                                                             \
  F(Disable)                                                                                            \
  F(Viewport)                                                                                           \
  F(Scissor) F(Clear) F(ClearColor) F(ClearDepth) F(DepthFunc) F(DepthMask) F(DepthRange) F(ColorMask)  \
      F(BlendFunc) F(CullFace) F(FrontFace) F(PolygonMode) F(MatrixMode) F(LoadIdentity) F(LoadMatrixf) \
          F(MultMatrixf) F(PushMatrix) F(PopMatrix) F(Translatef) F(Scalef) F(CallList) F(Color4fv)     \
              F(BindTexture) F(TexParameteri) F(DrawBuffer) F(ReadBuffer) F(GenTextures) F(TexImage2D)  \
                  F(DeleteTextures) F(Rectf)
    EVALBUS_GL(EVALBUS_LOAD)
#define EVALBUS_NEW_GL(F)                                                                                   \
  F(ActiveTexture, ACTIVETEXTURE)                                                                           \
  F(BindFramebuffer, BINDFRAMEBUFFER)                                                                       \
  F(CreateShader, CREATESHADER)                                                                             \
  F(ShaderSource, SHADERSOURCE)                                                                             \
  F(CompileShader, COMPILESHADER) F(CreateProgram, CREATEPROGRAM) F(AttachShader, ATTACHSHADER)             \
      F(LinkProgram, LINKPROGRAM) F(GetProgramiv, GETPROGRAMIV) F(GetProgramInfoLog, GETPROGRAMINFOLOG)     \
          F(UseProgram, USEPROGRAM) F(DeleteShader, DELETESHADER) F(DeleteProgram, DELETEPROGRAM)           \
              F(GetUniformLocation, GETUNIFORMLOCATION) F(Uniform1i, UNIFORM1I) F(Uniform3fv, UNIFORM3FV)   \
                  F(Uniform4fv, UNIFORM4FV) F(UniformMatrix4fv, UNIFORMMATRIX4FV)                           \
                      F(GenFramebuffers, GENFRAMEBUFFERS) F(DeleteFramebuffers, DELETEFRAMEBUFFERS)         \
                          F(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D) F(BlitFramebuffer, BLITFRAMEBUFFER) \
                              F(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)                             \
                                  F(BindRenderbuffer, BINDRENDERBUFFER)                                     \
                                      F(GetRenderbufferParameteriv, GETRENDERBUFFERPARAMETERIV)             \
                                          F(Uniform2f, UNIFORM2F)
#define EVALBUS_LOAD_NEW(name, type) EVALBUS_LOAD(name)
    EVALBUS_NEW_GL(EVALBUS_LOAD_NEW)
  }
#define EVALBUS_DECLARE(name) decltype(gl##name)* name;
  EVALBUS_GL(EVALBUS_DECLARE)
#define EVALBUS_DECLARE_NEW(name, type) PFNGL##type##PROC name;
  EVALBUS_NEW_GL(EVALBUS_DECLARE_NEW)
};

struct Vec {
  float x, y, z;
};
Vec Of(const float* v) { return {v[0], v[1], v[2]}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
float Dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec Cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec Unit(Vec a) {
  const float length = std::sqrt(Dot(a, a));
  return {a.x / length, a.y / length, a.z / length};
}

// By columns, as OpenGL's.
using Matrix = std::array<float, 16>;

Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (size_t column = 0; column < 4; ++column) {
    for (size_t row = 0; row < 4; ++row) {
      for (size_t k = 0; k < 4; ++k) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
}

// From the world to an eye here: x to the right, y up, z towards the viewer.
Matrix LookAlong(Vec eye, Vec forward, Vec up) {
  const Vec f = Unit(forward), s = Unit(Cross(f, up)), u = Unit(Cross(s, f));
  return {s.x, u.x, -f.x, 0, s.y,          u.y,          -f.y,        0,
          s.z, u.z, -f.z, 0, -Dot(s, eye), -Dot(u, eye), Dot(f, eye), 1};
}
// Of a perspective one.
Matrix InverseOfProjection(const Matrix& m) {
  Matrix inverse{};
  inverse[0] = 1 / m[0];
  inverse[5] = 1 / m[5];
  inverse[11] = 1 / m[14];
  inverse[12] = m[8] / m[0];
  inverse[13] = m[9] / m[5];
  inverse[14] = -1;
  inverse[15] = m[10] / m[14];
  return inverse;
}
// Of one that turns and moves, and does no more.
Matrix Inverse(const Matrix& m) {
  Matrix inverse{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) inverse[4 * i + j] = m[4 * j + i];
    inverse[12 + i] = -(m[4 * i] * m[12] + m[4 * i + 1] * m[13] + m[4 * i + 2] * m[14]);
  }
  inverse[15] = 1;
  return inverse;
}

// All that is seen of it.
void Append(const mjvGeom& geom, std::vector<float>* signature) {
  for (const int number : {geom.type, geom.dataid, geom.texid, geom.texuniform, geom.texcoord}) {
    signature->push_back(static_cast<float>(number));
  }
  signature->insert(signature->end(),
                    {geom.texrepeat[0], geom.texrepeat[1], geom.emission, geom.specular, geom.shininess});
  signature->insert(signature->end(), geom.size, geom.size + 3);
  signature->insert(signature->end(), geom.pos, geom.pos + 3);
  signature->insert(signature->end(), geom.mat, geom.mat + 9);
  signature->insert(signature->end(), geom.rgba, geom.rgba + 4);
}

bool IsStatic(const mjvGeom& geom) { return geom.category == mjCAT_STATIC; }

bool IsOpaque(const mjvGeom& geom, bool is_behind) {
  return geom.rgba[3] >= 0.995f && !(geom.type == mjGEOM_PLANE && is_behind);
}

}  // namespace

struct ScenePainter::Impl {
  struct Program {
    GLuint id;
    GLint light_direction, light_ambient, light_diffuse, light_specular, material, plane_s, plane_t, plane_r,
        shadow_from_eye;
    // Of the picture that is being drawn: lights and shadow have been told.
    bool is_ready = false;
  };

  Impl(const mjModel&, const mjrContext& the_context) : context(the_context) {
    for (int i = 0; i < context.ntexture && sky < 0; ++i) {
      if (context.textureType[i] == mjTEXTURE_SKYBOX) sky = i;
    }
    shadow_texture = context.shadowTex;
    GLint format = 0;
    gl.BindRenderbuffer(GL_RENDERBUFFER, context.offDepthStencil);
    gl.GetRenderbufferParameteriv(GL_RENDERBUFFER, GL_RENDERBUFFER_INTERNAL_FORMAT, &format);
    depth_format = static_cast<GLenum>(format);
    shadow_program = Link(kShadowVertexShader, kShadowFragmentShader);
    gl.UseProgram(shadow_program);
    gl.Uniform1i(gl.GetUniformLocation(shadow_program, "dark"), 0);
    gl.Uniform1i(gl.GetUniformLocation(shadow_program, "shadow_map"), 1);
    gl.Uniform1i(gl.GetUniformLocation(shadow_program, "depth"), 2);
    gl.UseProgram(0);
  }
  ~Impl() {
    for (const auto& [key, program] : programs) gl.DeleteProgram(program.id);
    for (const Backdrop& backdrop : backdrops) Delete(backdrop);
    if (static_shadows.fbo) Delete(static_shadows);
    gl.DeleteProgram(shadow_program);
  }

  GLuint Shader(GLenum type, const std::string& text) {
    const GLuint shader = gl.CreateShader(type);
    const char* source = text.c_str();
    gl.ShaderSource(shader, 1, &source, nullptr);
    gl.CompileShader(shader);
    return shader;
  }

  GLuint Link(const std::string& vertex_shader, const std::string& fragment_shader) {
    const GLuint program = gl.CreateProgram();
    for (const GLuint shader :
         {Shader(GL_VERTEX_SHADER, vertex_shader), Shader(GL_FRAGMENT_SHADER, fragment_shader)}) {
      gl.AttachShader(program, shader);
      gl.DeleteShader(shader);
    }
    gl.LinkProgram(program);
    GLint is_linked = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &is_linked);
    if (!is_linked) {
      char said[300] = "";
      gl.GetProgramInfoLog(program, sizeof said, nullptr, said);
      throw EnvironmentError(std::string("this OpenGL refuses our shaders: ") + said);
    }
    return program;
  }

  Program Make(Texture texture, bool shadows, int lights) {
    static constexpr const char* kNames[] = {"PLAIN", "FLAT", "EXPLICIT", "CUBE", "SKY"};
    const std::string head =
        fmt::format("#version 120\n#define LIGHTS {}\n#define {}\n{}", lights,
                    kNames[static_cast<int>(texture)], shadows ? "#define SHADOWS\n" : "");
    Program program{};
    program.id = Link(head + kVertexShader, head + kFragmentShader);
    const auto find = [&](const char* name) { return gl.GetUniformLocation(program.id, name); };
    program.light_direction = find("light_direction");
    program.light_ambient = find("light_ambient");
    program.light_diffuse = find("light_diffuse");
    program.light_specular = find("light_specular");
    program.material = find("material");
    program.plane_s = find("plane_s");
    program.plane_t = find("plane_t");
    program.plane_r = find("plane_r");
    program.shadow_from_eye = find("shadow_from_eye");
    gl.UseProgram(program.id);
    gl.Uniform1i(find("flat_texture"), 0);
    gl.Uniform1i(find("cube_texture"), 0);
    gl.Uniform1i(find("shadow_map"), 1);
    return program;
  }

  // The program is in use from now on, and knows the lights.
  const Program& Use(Texture texture, bool shadows) {
    const int lights = static_cast<int>(light_direction.size()) - (shadows ? 1 : 0);
    const auto key = std::tuple(texture, shadows, lights);
    auto found = programs.find(key);
    if (found == programs.end()) found = programs.emplace(key, Make(texture, shadows, lights)).first;
    Program& program = found->second;
    if (in_use != program.id) gl.UseProgram(in_use = program.id);
    if (!program.is_ready) {
      const auto count = static_cast<GLsizei>(light_direction.size());
      gl.Uniform3fv(program.light_direction, count, &light_direction[0].x);
      gl.Uniform3fv(program.light_ambient, count, &light_ambient[0].x);
      gl.Uniform3fv(program.light_diffuse, count, &light_diffuse[0].x);
      gl.Uniform3fv(program.light_specular, count, &light_specular[0].x);
      gl.UniformMatrix4fv(program.shadow_from_eye, 1, GL_FALSE, shadow_from_eye.data());
      program.is_ready = true;
    }
    return program;
  }

  void Planes(const Program& program, const mjvGeom& geom, bool is_cube) {
    const bool uniform = geom.texuniform != 0;
    if (is_cube) {
      const float s[4] = {uniform ? geom.size[0] : 1, 0, 0, 0}, t[4] = {0, uniform ? geom.size[1] : 1, 0, 0},
                  r[4] = {0, 0, uniform ? geom.size[2] : 1, 0};
      gl.Uniform4fv(program.plane_s, 1, s);
      gl.Uniform4fv(program.plane_t, 1, t);
      gl.Uniform4fv(program.plane_r, 1, r);
      return;
    }
    float scale[2] = {geom.texrepeat[0], geom.texrepeat[1]};
    for (int i = 0; i < 2; ++i) {
      if (geom.size[i] <= 0) continue;
      // Planes and meshes have their size already; a texture that repeats by the metre follows the size.
      if (geom.dataid >= 0) scale[i] /= geom.size[i];
      if (uniform) scale[i] *= geom.size[i];
    }
    const float s[4] = {0.5f * scale[0], 0, 0, -0.5f}, t[4] = {0, -0.5f * scale[1], 0, -0.5f};
    gl.Uniform4fv(program.plane_s, 1, s);
    gl.Uniform4fv(program.plane_t, 1, t);
  }

  // Its triangles, where it stands.
  void Triangles(const mjvGeom& geom) {
    const float* r = geom.mat;
    const float* size = geom.size;
    const float place[16] = {r[0], r[3], r[6], 0, r[1],        r[4],        r[7],        0,
                             r[2], r[5], r[8], 0, geom.pos[0], geom.pos[1], geom.pos[2], 1};
    gl.PushMatrix();
    gl.MultMatrixf(place);
    const auto data = static_cast<GLuint>(geom.dataid);
    switch (geom.type) {
      case mjGEOM_PLANE:
        if (geom.dataid < 0) gl.Scalef(size[0], size[1], 1);
        gl.CallList(context.basePlane + (geom.dataid < 0 ? 0 : data + 1));
        break;
      case mjGEOM_HFIELD:
        gl.CallList(context.baseHField + data);
        break;
      case mjGEOM_MESH:
        gl.CallList(context.baseMesh + data);
        break;
      case mjGEOM_CAPSULE: {
        const float radius = 0.5f * (size[0] + size[1]);
        gl.Scalef(size[0], size[1], size[2]);
        gl.CallList(context.baseBuiltin + kOpenCylinder);
        // The caps' centres are one radius above and below the origin of their lists.
        gl.Scalef(1, 1, radius / size[2]);
        gl.Translatef(0, 0, (size[2] - radius) / radius);
        gl.CallList(context.baseBuiltin + kSphereTop);
        gl.Translatef(0, 0, 2 * (radius - size[2]) / radius);
        gl.CallList(context.baseBuiltin + kSphereBottom);
        break;
      }
      default:
        gl.Scalef(size[0], size[1], size[2]);
        gl.CallList(context.baseBuiltin + (geom.type == mjGEOM_BOX        ? kBox
                                           : geom.type == mjGEOM_CYLINDER ? kCylinder
                                                                          : kSphere));
    }
    gl.PopMatrix();
  }

  bool IsBehind(const mjvGeom& geom) const {
    return Dot(eye - Of(geom.pos), {geom.mat[2], geom.mat[5], geom.mat[8]}) < 0;
  }
  // Whether nothing of it can be in the picture.
  bool IsOutside(const mjvGeom& geom) const {
    if (geom.modelrbound <= 0) return false;
    const Vec centre = Of(geom.pos) - eye;
    return std::ranges::any_of(sides, [&](const Vec& side) { return Dot(side, centre) > geom.modelrbound; });
  }

  void Paint(const mjvGeom& geom, bool shadows) {
    const bool is_behind = geom.type == mjGEOM_PLANE && IsBehind(geom);
    const int type = geom.texid >= 0 ? context.textureType[geom.texid] : -1;
    const Texture texture = type < 0               ? Texture::kNone
                            : geom.texcoord        ? Texture::kExplicit
                            : type == mjTEXTURE_2D ? Texture::kFlat
                                                   : Texture::kCube;
    const Program& program = Use(texture, shadows);
    if (texture != Texture::kNone) {
      const GLenum target = texture == Texture::kCube ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
      gl.BindTexture(target, context.texture[geom.texid]);
      if (texture != Texture::kExplicit) Planes(program, geom, texture == Texture::kCube);
    }
    // A plane is seen through from behind.
    const float colour[4] = {geom.rgba[0], geom.rgba[1], geom.rgba[2], geom.rgba[3] * (is_behind ? 0.3f : 1)};
    gl.Color4fv(colour);
    const float material[3] = {geom.emission, geom.specular, 128 * geom.shininess};
    gl.Uniform3fv(program.material, 1, material);
    if (is_behind) gl.CullFace(GL_FRONT);
    Triangles(geom);
    if (is_behind) gl.CullFace(GL_BACK);
  }

  // A picture of what does not move, with everything that it depends on.
  struct Backdrop {
    GLuint fbo = 0, colour = 0, dark = 0, depth = 0;
    std::vector<float> signature;
  };

  GLuint MakeTexture(GLsizei width, GLsizei height, GLenum format) {
    const bool is_colour = format == GL_RGBA8, is_plain = format == GL_DEPTH_COMPONENT24;
    GLuint texture = 0;
    gl.GenTextures(1, &texture);
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.TexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), width, height, 0,
                  is_colour  ? GL_RGBA
                  : is_plain ? GL_DEPTH_COMPONENT
                             : GL_DEPTH_STENCIL,
                  is_colour                        ? GL_UNSIGNED_BYTE
                  : is_plain                       ? GL_UNSIGNED_INT
                  : format == GL_DEPTH32F_STENCIL8 ? GL_FLOAT_32_UNSIGNED_INT_24_8_REV
                                                   : GL_UNSIGNED_INT_24_8,
                  nullptr);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
  }
  Backdrop MakeBackdrop(GLsizei width, GLsizei height, GLenum format, bool has_colour) {
    Backdrop made;
    gl.GenFramebuffers(1, &made.fbo);
    made.depth = MakeTexture(width, height, format);
    if (has_colour) {
      made.colour = MakeTexture(width, height, GL_RGBA8);
      made.dark = MakeTexture(width, height, GL_RGBA8);
    }
    gl.BindFramebuffer(GL_FRAMEBUFFER, made.fbo);
    const bool has_stencil = format != GL_DEPTH_COMPONENT24;
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, has_stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT,
                            GL_TEXTURE_2D, made.depth, 0);
    if (has_colour)
      gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, made.colour, 0);
    gl.DrawBuffer(has_colour ? GL_COLOR_ATTACHMENT0 : GL_NONE);
    gl.ReadBuffer(has_colour ? GL_COLOR_ATTACHMENT0 : GL_NONE);
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw EnvironmentError("OpenGL cannot keep a picture of this size");
    }
    return made;
  }
  void Delete(const Backdrop& backdrop) {
    for (const GLuint texture : {backdrop.colour, backdrop.dark, backdrop.depth})
      gl.DeleteTextures(1, &texture);
    gl.DeleteFramebuffers(1, &backdrop.fbo);
  }
  void Copy(GLuint from, GLuint to, GLsizei width, GLsizei height, GLbitfield what) {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, from);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, to);
    gl.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, what, GL_NEAREST);
  }

  template <class F>
  void PaintOpaque(const mjvScene& scene, bool shadows, const F& is_wanted) {
    for (int i = 0; i < scene.ngeom; ++i) {
      const mjvGeom& geom = scene.geoms[i];
      if (is_wanted(geom) && IsOpaque(geom, IsBehind(geom)) && !IsOutside(geom)) Paint(geom, shadows);
    }
  }
  // What does not move, and the sky. Planes are behind everything: what is hidden then is not coloured first.
  void PaintStatic(const mjvScene& scene, bool shadows) {
    PaintOpaque(scene, shadows, [](const auto& geom) { return IsStatic(geom) && geom.type != mjGEOM_PLANE; });
    PaintOpaque(scene, shadows, [](const auto& geom) { return IsStatic(geom) && geom.type == mjGEOM_PLANE; });
    if (sky >= 0 && scene.flags[mjRND_SKYBOX]) PaintSky(scene.camera[0].frustum_far);
  }
  void Begin(GLuint fbo, mjrRect view) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, fbo);
    gl.DrawBuffer(GL_COLOR_ATTACHMENT0);
    gl.Viewport(0, 0, view.width, view.height);
    for (auto& [key, program] : programs) program.is_ready = false;
    in_use = 0;
    gl.ActiveTexture(GL_TEXTURE1);
    gl.BindTexture(GL_TEXTURE_2D, shadow_texture);
    gl.ActiveTexture(GL_TEXTURE0);
  }
  void ClearView(mjrRect view) {
    gl.Scissor(0, 0, view.width, view.height);
    gl.Enable(GL_SCISSOR_TEST);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl.Disable(GL_SCISSOR_TEST);
  }
  const Backdrop& FindBackdrop(mjrRect view, const mjvScene& scene, bool shadows,
                               std::vector<float> signature);
  void PaintBackdrop(mjrRect view, const mjvScene& scene, bool shadows, const Matrix& projection,
                     const Matrix& eye_from_world);
  // Where shadows of what moves can be.
  struct Tiles {
    int columns, rows;
    std::vector<char> marked;
    bool At(int row, int column) const { return marked[static_cast<size_t>(row * columns + column)] != 0; }
  };
  Tiles FindShadows(mjrRect view, const mjvScene& scene, const Matrix& clip_from_world) const;
  void PaintShadows(const mjvScene& scene, const mjvLight& light);
  void PaintSky(float far);
  void Paint(mjrRect view, const mjvScene& scene, bool is_fixed, bool keep_shadows);

  const GlFunctions gl;
  const mjrContext& context;
  std::map<std::tuple<Texture, bool, int>, Program> programs;
  int sky = -1;
  // Of the offscreen buffer.
  GLenum depth_format = GL_DEPTH24_STENCIL8;
  Backdrop static_shadows;
  // The one used last is the last.
  std::vector<Backdrop> backdrops;
  GLuint shadow_program = 0;
  // The map of shadows that is looked into: MuJoCo's.
  GLuint shadow_texture = 0;

  // Of the picture that is being drawn. The light with a shadow is the last one, where there is one.
  GLuint in_use = 0;
  // What does not move.
  std::vector<float> unmoved;
  std::vector<Vec> light_direction, light_ambient, light_diffuse, light_specular;
  Vec light_forward{};
  Matrix shadow_from_world{}, shadow_from_eye{};
  Vec eye{};
  // Outwards, of the picture's four edges.
  std::array<Vec, 4> sides;
};

// Depths from the light, into MuJoCo's own map.
void ScenePainter::Impl::PaintShadows(const mjvScene& scene, const mjvLight& light) {
  const float clip = context.shadowClip, near = scene.camera[0].frustum_near,
              far = scene.camera[0].frustum_far;
  const Vec direction = Of(light.dir);
  light_forward = Unit(direction);
  Vec up = Cross(direction, {-1, 0, 0});
  if (Dot(up, up) <= 0.01f) up = Cross(direction, {0, 1, 0});
  const Matrix from_world = LookAlong(Of(light.pos), direction, up);
  const Matrix projection = {
      1 / clip, 0, 0, 0, 0, 1 / clip, 0, 0, 0, 0, -2 / (far - near), 0, 0, 0, -(far + near) / (far - near),
      1};
  const Matrix halve = {0.5f, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0, 0.5f, 0.5f, 0.5f, 1};
  shadow_from_world = halve * projection * from_world;

  gl.MatrixMode(GL_PROJECTION);
  gl.LoadMatrixf(projection.data());
  gl.MatrixMode(GL_MODELVIEW);
  gl.LoadMatrixf(from_world.data());
  // The edge stays empty: what is outside of the map has no shadow.
  gl.Viewport(1, 1, context.shadowSize - 2, context.shadowSize - 2);
  gl.ColorMask(0, 0, 0, 0);
  gl.UseProgram(in_use = 0);
  gl.Disable(GL_LIGHTING);
  gl.CullFace(GL_FRONT);
  const Vec right{from_world[0], from_world[4], from_world[8]},
      above{from_world[1], from_world[5], from_world[9]};
  const auto cast = [&](bool is_static) {
    for (int i = 0; i < scene.ngeom; ++i) {
      const mjvGeom& geom = scene.geoms[i];
      if (geom.category == mjCAT_DECOR || IsStatic(geom) != is_static) continue;
      const Vec centre = Of(geom.pos) - Of(light.pos);
      const float reach = clip + geom.modelrbound;
      if (geom.modelrbound > 0 &&
          (std::abs(Dot(right, centre)) > reach || std::abs(Dot(above, centre)) > reach)) {
        continue;
      }
      Triangles(geom);
    }
  };
  // What does not move casts its shadows once.
  const GLsizei size = context.shadowSize;
  std::vector<float> signature = unmoved;
  signature.insert(signature.end(), shadow_from_world.begin(), shadow_from_world.end());
  if (!static_shadows.fbo) {
    static_shadows = MakeBackdrop(size, size, GL_DEPTH_COMPONENT24, false);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
  if (static_shadows.signature != signature) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, static_shadows.fbo);
    gl.Clear(GL_DEPTH_BUFFER_BIT);
    cast(true);
    static_shadows.signature = std::move(signature);
  }
  Copy(static_shadows.fbo, context.shadowFBO, size, size, GL_DEPTH_BUFFER_BIT);
  gl.BindFramebuffer(GL_FRAMEBUFFER, context.shadowFBO);
  gl.DrawBuffer(GL_NONE);
  cast(false);
  gl.CullFace(GL_BACK);
  gl.ColorMask(1, 1, 1, 1);
}

// A cylinder around the eye, as far away as can be.
void ScenePainter::Impl::PaintSky(float far) {
  const Program& program = Use(Texture::kSky, false);
  gl.BindTexture(GL_TEXTURE_CUBE_MAP, context.texture[sky]);
  // Never drawn smaller than it is; looking for how much smaller would take half of the time.
  gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  const float s[4] = {1, 0, 0, 0}, t[4] = {0, 0, 1, 0}, r[4] = {0, -1, 0, 0};
  gl.Uniform4fv(program.plane_s, 1, s);
  gl.Uniform4fv(program.plane_t, 1, t);
  gl.Uniform4fv(program.plane_r, 1, r);
  gl.CullFace(GL_FRONT);
  gl.PushMatrix();
  gl.Translatef(eye.x, eye.y, eye.z);
  const float distance = 0.7f * far;
  gl.Scalef(distance, distance, distance);
  gl.CallList(context.baseBuiltin + kCylinder);
  gl.PopMatrix();
  gl.CullFace(GL_BACK);
}

void ScenePainter::Impl::Paint(mjrRect view, const mjvScene& scene, bool is_fixed, bool keep_shadows) {
  const mjvGLCamera camera = mjv_averageCamera(scene.camera, scene.camera + 1);
  eye = Of(camera.pos);
  const Matrix eye_from_world = LookAlong(eye, Of(camera.forward), Of(camera.up));

  const int shadow_light = [&] {
    if (!scene.flags[mjRND_SHADOW] || !context.shadowFBO) return -1;
    for (int i = 0; i < scene.nlight; ++i) {
      if (scene.lights[i].castshadow) return i;
    }
    return -1;
  }();
  light_direction.clear(), light_ambient.clear(), light_diffuse.clear(), light_specular.clear();
  const auto add = [&](int i) {
    const mjvLight& light = scene.lights[i];
    const Vec d = Unit(Of(light.headlight ? camera.forward : light.dir));
    const Matrix& m = eye_from_world;
    light_direction.push_back({-(m[0] * d.x + m[4] * d.y + m[8] * d.z),
                               -(m[1] * d.x + m[5] * d.y + m[9] * d.z),
                               -(m[2] * d.x + m[6] * d.y + m[10] * d.z)});
    light_ambient.push_back(Of(light.ambient));
    light_diffuse.push_back(Of(light.diffuse));
    light_specular.push_back(Of(light.specular));
  };
  for (int i = 0; i < scene.nlight; ++i) {
    if (i != shadow_light) add(i);
  }
  if (shadow_light >= 0) add(shadow_light);

  gl.Disable(GL_BLEND);
  gl.Disable(GL_FOG);
  gl.Enable(GL_DEPTH_TEST);
  gl.Enable(GL_CULL_FACE);
  gl.FrontFace(GL_CCW);
  gl.CullFace(GL_BACK);
  gl.PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  gl.DepthMask(GL_TRUE);
  gl.DepthFunc(GL_LEQUAL);
  gl.DepthRange(0, 1);
  gl.ClearColor(0, 0, 0, 0);
  gl.ClearDepth(1);
  unmoved.clear();
  for (int i = 0; i < scene.ngeom; ++i) {
    if (IsStatic(scene.geoms[i])) Append(scene.geoms[i], &unmoved);
  }
  if (shadow_light >= 0 && !keep_shadows) PaintShadows(scene, scene.lights[shadow_light]);

  const float near = camera.frustum_near, far = camera.frustum_far, bottom = camera.frustum_bottom,
              top = camera.frustum_top, middle = camera.frustum_center,
              half = 0.5f * static_cast<float>(view.width) / static_cast<float>(view.height) * (top - bottom);
  const Matrix projection = {near / half,
                             0,
                             0,
                             0,
                             0,
                             2 * near / (top - bottom),
                             0,
                             0,
                             middle / half,
                             (top + bottom) / (top - bottom),
                             -(far + near) / (far - near),
                             -1,
                             0,
                             0,
                             -2 * far * near / (far - near),
                             0};
  gl.MatrixMode(GL_PROJECTION);
  gl.LoadMatrixf(projection.data());
  gl.MatrixMode(GL_MODELVIEW);
  gl.LoadMatrixf(eye_from_world.data());
  shadow_from_eye = shadow_from_world * Inverse(eye_from_world);

  const auto in_world = [&](Vec v) {
    const Matrix& m = eye_from_world;
    return Unit({m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
                 m[8] * v.x + m[9] * v.y + m[10] * v.z});
  };
  sides = {in_world({near, 0, middle + half}), in_world({-near, 0, -(middle - half)}),
           in_world({0, near, top}), in_world({0, -near, -bottom})};

  const bool shadows = shadow_light >= 0;
  if (is_fixed) {
    PaintBackdrop(view, scene, shadows, projection, eye_from_world);
    Begin(context.offFBO, view);
  } else {
    Begin(context.offFBO, view);
    ClearView(view);
  }
  // What moves stands in front of most of the rest.
  PaintOpaque(scene, shadows, [](const mjvGeom& geom) { return !IsStatic(geom); });
  if (!is_fixed) PaintStatic(scene, shadows);

  // As MuJoCo: from the front and from the back, so that what is behind is seen through what is in front.
  std::vector<std::pair<float, const mjvGeom*>> by_distance;
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    if (IsOpaque(geom, IsBehind(geom)) || IsOutside(geom)) continue;
    const Vec to = Of(geom.pos) - eye;
    by_distance.emplace_back(geom.type == mjGEOM_PLANE ? 1e10f : std::sqrt(Dot(to, to)) - geom.modelrbound,
                             &geom);
  }
  std::ranges::stable_sort(by_distance, {}, [](const auto& entry) { return entry.first; });
  if (!by_distance.empty()) {
    gl.DepthMask(GL_FALSE);
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    for (auto& [key, program] : programs) program.is_ready = false;
    for (size_t i = 0; i < by_distance.size(); ++i) Paint(*by_distance[i].second, false);
    for (size_t i = by_distance.size(); i-- > 0;) Paint(*by_distance[i].second, false);
    gl.DepthMask(GL_TRUE);
    gl.Disable(GL_BLEND);
  }
  gl.UseProgram(0);
  gl.CullFace(GL_BACK);
}

const ScenePainter::Impl::Backdrop& ScenePainter::Impl::FindBackdrop(mjrRect view, const mjvScene& scene,
                                                                     bool shadows,
                                                                     std::vector<float> signature) {
  const auto known = std::ranges::find(backdrops, signature, &Backdrop::signature);
  if (known != backdrops.end()) {
    std::rotate(known, known + 1, backdrops.end());
    return backdrops.back();
  }
  if (backdrops.size() == kMaxBackdrops) {
    Delete(backdrops.front());
    backdrops.erase(backdrops.begin());
  }
  const Backdrop& made =
      backdrops.emplace_back(MakeBackdrop(context.offWidth, context.offHeight, depth_format, true));
  const auto paint = [&] {
    Begin(made.fbo, view);
    ClearView(view);
    PaintStatic(scene, shadows);
  };
  if (shadows) {
    // Without the light that has a shadow: the last one.
    const auto lights = std::tuple(light_ambient.back(), light_diffuse.back(), light_specular.back());
    light_ambient.back() = light_diffuse.back() = light_specular.back() = {0, 0, 0};
    gl.BindFramebuffer(GL_FRAMEBUFFER, made.fbo);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, made.dark, 0);
    paint();
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, made.colour, 0);
    std::tie(light_ambient.back(), light_diffuse.back(), light_specular.back()) = lights;
  }
  // With the shadows of what does not move, and no others.
  std::swap(shadow_texture, static_shadows.depth);
  paint();
  std::swap(shadow_texture, static_shadows.depth);
  backdrops.back().signature = std::move(signature);
  return backdrops.back();
}

ScenePainter::Impl::Tiles ScenePainter::Impl::FindShadows(mjrRect view, const mjvScene& scene,
                                                          const Matrix& clip_from_world) const {
  Tiles tiles{(view.width + kTile - 1) / kTile, (view.height + kTile - 1) / kTile, {}};
  tiles.marked.resize(static_cast<size_t>(tiles.columns * tiles.rows));
  const Matrix& m = clip_from_world;
  const auto row = [&](size_t i, Vec v) { return m[i] * v.x + m[4 + i] * v.y + m[8 + i] * v.z + m[12 + i]; };
  // How far a unit of length can be in these coordinates.
  const auto length = [&](size_t i) {
    return std::sqrt(m[i] * m[i] + m[4 + i] * m[4 + i] + m[8 + i] * m[8 + i]);
  };
  // Tiles of all points of which x and w are at most so far from these.
  const auto span = [](float x, float dx, float w, float dw, int pixels, int count) {
    const float least = (x - dx) / (x - dx < 0 ? w - dw : w + dw),
                most = (x + dx) / (x + dx < 0 ? w + dw : w - dw);
    const auto tile = [&](float at) {
      const float wide = static_cast<float>(pixels) / kTile;
      return std::clamp((at + 1) / 2 * wide, -1.0f, static_cast<float>(count));
    };
    return std::pair(std::max(0, static_cast<int>(std::floor(tile(least)))),
                     std::min(count - 1, static_cast<int>(std::floor(tile(most)))));
  };
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& caster = scene.geoms[i];
    if (IsStatic(caster) || caster.category == mjCAT_DECOR) continue;
    const Vec from = Of(caster.pos);
    // To the last that the light can reach.
    float reach = 0;
    for (int k = 0; k < scene.ngeom; ++k) {
      const mjvGeom& geom = scene.geoms[k];
      if (!IsStatic(geom)) continue;
      const Vec to = Of(geom.pos) - from;
      if (geom.type == mjGEOM_PLANE) {
        const Vec normal{geom.mat[2], geom.mat[5], geom.mat[8]};
        const float slope = Dot(normal, light_forward);
        if (std::abs(slope) > 0.01f) reach = std::max(reach, Dot(normal, to) / slope);
      } else {
        reach = std::max(reach, Dot(to, light_forward) + geom.modelrbound);
      }
    }
    const float step = reach / kSteps, radius = caster.modelrbound + step / 2;
    for (int k = 0; k <= kSteps; ++k) {
      const float along = step * static_cast<float>(k);
      const Vec at{from.x + along * light_forward.x, from.y + along * light_forward.y,
                   from.z + along * light_forward.z};
      const float w = row(3, at), dw = radius * length(3);
      if (caster.modelrbound <= 0 || w - dw <= 0.01f) {
        // All around the eye, or of unknown size.
        if (caster.modelrbound > 0 && w + dw < 0) continue;
        std::ranges::fill(tiles.marked, 1);
        return tiles;
      }
      const auto [left, right] = span(row(0, at), radius * length(0), w, dw, view.width, tiles.columns);
      const auto [bottom, top] = span(row(1, at), radius * length(1), w, dw, view.height, tiles.rows);
      for (int y = bottom; y <= top; ++y) {
        for (int x = left; x <= right; ++x) tiles.marked[static_cast<size_t>(y * tiles.columns + x)] = 1;
      }
    }
  }
  return tiles;
}

// What does not move and the sky, as kept, and on it the shadows of what does.
void ScenePainter::Impl::PaintBackdrop(mjrRect view, const mjvScene& scene, bool shadows,
                                       const Matrix& projection, const Matrix& eye_from_world) {
  std::vector<float> signature = unmoved;
  for (const Matrix* matrix :
       {&projection, &eye_from_world, static_cast<const Matrix*>(&shadow_from_world)}) {
    if (shadows || matrix != &shadow_from_world) {
      signature.insert(signature.end(), matrix->begin(), matrix->end());
    }
  }
  for (const auto* lights : {&light_direction, &light_ambient, &light_diffuse, &light_specular}) {
    for (const Vec& v : *lights) signature.insert(signature.end(), {v.x, v.y, v.z});
  }
  signature.insert(signature.end(), {static_cast<float>(view.width), static_cast<float>(view.height),
                                     static_cast<float>(shadows)});
  const Backdrop& backdrop = FindBackdrop(view, scene, shadows, std::move(signature));
  Copy(backdrop.fbo, context.offFBO, view.width, view.height, GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  if (!shadows) return;
  Begin(context.offFBO, view);
  gl.UseProgram(in_use = shadow_program);
  const Matrix shadow_from_clip = shadow_from_eye * InverseOfProjection(projection);
  gl.UniformMatrix4fv(gl.GetUniformLocation(shadow_program, "shadow_from_clip"), 1, GL_FALSE,
                      shadow_from_clip.data());
  const float deeper[4] = {2 * shadow_from_clip[8], 2 * shadow_from_clip[9], 2 * shadow_from_clip[10],
                           2 * shadow_from_clip[11]};
  gl.Uniform4fv(gl.GetUniformLocation(shadow_program, "deeper"), 1, deeper);
  gl.Uniform2f(gl.GetUniformLocation(shadow_program, "buffer"), 1 / static_cast<float>(context.offWidth),
               1 / static_cast<float>(context.offHeight));
  gl.ActiveTexture(GL_TEXTURE2);
  gl.BindTexture(GL_TEXTURE_2D, backdrop.depth);
  gl.ActiveTexture(GL_TEXTURE0);
  gl.BindTexture(GL_TEXTURE_2D, backdrop.dark);
  gl.Disable(GL_DEPTH_TEST);
  gl.DepthMask(GL_FALSE);
  const Tiles tiles = FindShadows(view, scene, projection * eye_from_world);
  for (int row = 0; row < tiles.rows; ++row) {
    for (int begin = 0, end; begin < tiles.columns; begin = end) {
      for (end = begin; end < tiles.columns && tiles.At(row, end) == tiles.At(row, begin);) ++end;
      if (!tiles.At(row, begin)) continue;
      const auto edge = [](int tile, int pixels) {
        return 2 * static_cast<float>(std::min(tile * kTile, pixels)) / static_cast<float>(pixels) - 1;
      };
      gl.Rectf(edge(begin, view.width), edge(row, view.height), edge(end, view.width),
               edge(row + 1, view.height));
    }
  }
  gl.DepthMask(GL_TRUE);
  gl.Enable(GL_DEPTH_TEST);
}

ScenePainter::ScenePainter(const mjModel& model, const mjrContext& context)
    : impl_(std::make_unique<Impl>(model, context)) {}

ScenePainter::~ScenePainter() = default;

bool ScenePainter::Knows(const mjvScene& scene, const mjrContext& context) {
  if (context.rangeBuiltin != kNumShapes || scene.nlight == 0 || scene.nskin > 0 || scene.enabletransform ||
      scene.stereo != mjSTEREO_NONE || scene.framewidth > 0 || scene.flags[mjRND_FOG] ||
      scene.flags[mjRND_WIREFRAME] || scene.flags[mjRND_ADDITIVE] || scene.flags[mjRND_SEGMENT] ||
      !scene.flags[mjRND_CULL_FACE]) {
    return false;
  }
  int with_shadow = 0;
  for (int i = 0; i < scene.nlight; ++i) {
    if (!scene.lights[i].directional) return false;
    with_shadow += scene.lights[i].castshadow != 0;
  }
  if (with_shadow > 1) return false;
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    const bool is_endless = geom.type == mjGEOM_PLANE && geom.size[0] <= 0 && geom.size[1] <= 0;
    const bool is_mirror = (geom.type == mjGEOM_PLANE || geom.type == mjGEOM_BOX) && geom.reflectance > 0 &&
                           geom.rgba[3] >= 0.995f;
    if (geom.type > mjGEOM_MESH || is_endless || is_mirror || geom.label[0]) return false;
    if (geom.texid >= 0 && geom.texcoord && context.textureType[geom.texid] != mjTEXTURE_2D) return false;
  }
  return true;
}

void ScenePainter::Paint(mjrRect view, const mjvScene& scene, bool is_fixed, bool keep_shadows) {
  impl_->Paint(view, scene, is_fixed, keep_shadows);
}

}  // namespace evalbus::viz
