#include "viz/images/painter/gl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <vector>

#include "base/errors.h"
#include "base/forked_work.h"

namespace evalbus::viz {
namespace {

// Values of --gl. The last two values select one of the other three.
constexpr char kOsMesaName[] = "osmesa", kEglSoftwareName[] = "egl-software", kEglName[] = "egl",
               kSoftwareName[] = "software", kAutoName[] = "auto";

constexpr char kOsMesaFile[] = "libOSMesa.so.8";

template <class Function>
void Load(void* library, const char* file, const char* name, Function** function) {
  *function = reinterpret_cast<Function*>(dlsym(library, name));
  if (!*function) throw EnvironmentError(fmt::format("{} has no {}", file, name));
}

// Disables the rasterizer threads of llvmpipe; must be called before Mesa is loaded. In Mesa 22.3 these
// threads have a use-after-free, because llvmpipe checks without a lock which textures are in use. It crashed
// a process once in 28,000 images. Without these threads, the calling thread rasterizes, which takes no
// longer.
void NoMesaThreads() { setenv("LP_NUM_THREADS", "0", 1); }

// Returns the library, or nullptr if it is not installed.
void* LoadOsMesa() {
  NoMesaThreads();
  // The shader cache is disabled as well, because its writer thread would not survive the fork of the video
  // renderer, and because it writes to the user's home directory.
  setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
  return dlopen(kOsMesaFile, RTLD_NOW | RTLD_GLOBAL);
}

// The OSMesa library, which is loaded once and never unloaded. MuJoCo looks up the OpenGL functions in the
// same library. OSMesa's functions are declared here, because Mesa has contained neither OSMesa nor its
// header since version 25.1.
struct OsMesa {
  OsMesa() {
    void* library = LoadOsMesa();
    if (!library) {
      throw EnvironmentError("--gl osmesa requires OSMesa: install it with 'apt-get install libosmesa6' (" +
                             std::string(dlerror()) + ")");
    }
    Load(library, kOsMesaFile, "OSMesaCreateContextExt", &create);
    Load(library, kOsMesaFile, "OSMesaMakeCurrent", &make_current);
    Load(library, kOsMesaFile, "OSMesaDestroyContext", &destroy);
    Load(library, kOsMesaFile, "OSMesaGetProcAddress", &function);
  }

  void* (*create)(GLenum format, GLint depth_bits, GLint stencil_bits, GLint accumulation_bits, void* shared);
  GLboolean (*make_current)(void* context, void* buffer, GLenum type, GLsizei width, GLsizei height);
  void (*destroy)(void* context);
  void (*(*function)(const char* name))();
};

struct Egl {
  explicit Egl(bool software) {
    NoMesaThreads();  // in case EGL falls back to software rendering
    if (software) setenv("LIBGL_ALWAYS_SOFTWARE", "true", 1);
    void* library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_GLOBAL);
    if (!library) {
      throw EnvironmentError(
          fmt::format("{} 'apt-get install libegl1' ({})",
                      software ? "rendering requires OSMesa or EGL: 'apt-get install libosmesa6' or"
                               : "--gl egl requires EGL: install it with",
                      dlerror()));
    }
    Load(library, "libEGL.so.1", "eglGetProcAddress", &function);
    Load(library, "libEGL.so.1", "eglInitialize", &initialize);
    Load(library, "libEGL.so.1", "eglBindAPI", &bind_api);
    Load(library, "libEGL.so.1", "eglChooseConfig", &choose_config);
    Load(library, "libEGL.so.1", "eglCreateContext", &create);
    Load(library, "libEGL.so.1", "eglMakeCurrent", &make_current);
    Load(library, "libEGL.so.1", "eglDestroyContext", &destroy);
    Open(software);
  }

  // Opens the first device that works, in the order in which EGL lists the devices. If no device works, or if
  // `software` is true, Mesa renders in software.
  void Open(bool software) {
    const auto devices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(function("eglQueryDevicesEXT"));
    const auto get_display =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(function("eglGetPlatformDisplayEXT"));
    std::vector<EGLDisplay> displays;
    EGLDeviceEXT device[16];
    EGLint count = 0;
    if (!software && devices && get_display && devices(16, device, &count)) {
      for (EGLint i = 0; i < count; ++i) {
        displays.push_back(get_display(EGL_PLATFORM_DEVICE_EXT, device[i], nullptr));
      }
    }
    if (get_display) {
      displays.push_back(get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    }
    constexpr EGLint kWanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                  EGL_NONE};
    for (EGLDisplay candidate : displays) {
      EGLint configs = 0;
      if (candidate != EGL_NO_DISPLAY && initialize(candidate, nullptr, nullptr) &&
          bind_api(EGL_OPENGL_API) && choose_config(candidate, kWanted, &config, 1, &configs) &&
          configs == 1) {
        display = candidate;
        return;
      }
    }
    throw EnvironmentError(software ? "EGL cannot render in software on this machine: install Mesa with "
                                      "'apt-get install libegl-mesa0 libgl1-mesa-dri'"
                                    : "EGL finds no device on this machine that supports OpenGL");
  }

  decltype(eglGetProcAddress)* function;
  decltype(eglInitialize)* initialize;
  decltype(eglBindAPI)* bind_api;
  decltype(eglChooseConfig)* choose_config;
  decltype(eglCreateContext)* create;
  decltype(eglMakeCurrent)* make_current;
  decltype(eglDestroyContext)* destroy;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLConfig config = nullptr;
};

enum class GlKind { kUndecided, kOsMesa, kEglSoftware, kEgl };
std::atomic<GlKind> g_kind = GlKind::kUndecided;

bool IsEgl() { return g_kind == GlKind::kEgl || g_kind == GlKind::kEglSoftware; }

const OsMesa& Mesa() {
  static const OsMesa mesa;
  return mesa;
}

const Egl& TheEgl() {
  static const Egl egl(g_kind == GlKind::kEglSoftware);
  return egl;
}

// name: "osmesa", "egl-software" or "egl".
GlKind KindOf(const std::string& name) {
  return name == kOsMesaName ? GlKind::kOsMesa : name == kEglName ? GlKind::kEgl : GlKind::kEglSoftware;
}

const char* NameOf(GlKind kind) {
  return kind == GlKind::kOsMesa ? kOsMesaName : kind == GlKind::kEgl ? kEglName : kEglSoftwareName;
}

std::string RendererName() {
  const auto get = reinterpret_cast<decltype(glGetString)*>(GlFunction("glGetString"));
  const unsigned char* name = get(GL_RENDERER);
  return name ? reinterpret_cast<const char*>(name) : "unknown";
}

bool IsSoftware(const std::string& renderer) {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "Software Rasterizer", "unknown"}) {
    if (renderer.find(name) != std::string::npos) return true;
  }
  return false;
}

// Runs `work` in a child process. In this process, a loaded library could not be unloaded, and MuJoCo would
// use it for drawing. Throws the exceptions of `work`, and EnvironmentError.
void InChild(const std::string& library, const std::function<void()>& work) {
  constexpr int kTimeoutMs = 60000, kPollMs = 10;
  ForkedWork check("the check of " + library, work);
  for (int waited_ms = 0; !check.HasEnded(); waited_ms += kPollMs) {
    if (waited_ms > kTimeoutMs) {
      throw EnvironmentError(fmt::format("{} does not respond within {} s", library, kTimeoutMs / 1000));
    }
    poll(nullptr, 0, kPollMs);
  }
  check.CheckEnd();
}

// Returns the device that the library draws with. Throws EnvironmentError.
std::string DeviceOf(const std::string& library) {
  constexpr size_t kMaxBytes = 256;
  const SharedMemory name(kMaxBytes);
  InChild(library, [&] {
    g_kind = KindOf(library);
    const GlContext context;
    const std::string renderer = RendererName();
    std::copy_n(renderer.data(), std::min(renderer.size(), kMaxBytes - 1), static_cast<char*>(name.get()));
  });
  return static_cast<const char*>(name.get());
}

bool HasOsMesa() {
  try {
    InChild(kOsMesaName, [] { Mesa(); });
    return true;
  } catch (const EnvironmentError&) {
    return false;
  }
}

bool HasGpuDevice() {
  std::error_code none;
  return std::filesystem::exists("/dev/dri/renderD128", none) ||
         std::filesystem::exists("/dev/nvidiactl", none);
}

// Returns whether EGL can draw OpenGL on a graphics processor.
bool HasGraphicsProcessor() {
  if (!HasGpuDevice()) return false;
  try {
    return !IsSoftware(DeviceOf(kEglName));
  } catch (const EnvironmentError&) {
    return false;
  }
}

// Returns "osmesa", "egl-software" or "egl", depending on what `name` selects on this machine. Loads no
// library into this process. Throws the errors of CheckGl().
std::string Resolve(const std::string& name, bool (*has_osmesa)()) {
  CheckGl(name);
  if (name == kAutoName && HasGraphicsProcessor()) return kEglName;
  if (name == kAutoName || name == kSoftwareName) return has_osmesa() ? kOsMesaName : kEglSoftwareName;
  return name;
}

}  // namespace

void CheckGl(const std::string& name) {
  for (const char* known : {kSoftwareName, kOsMesaName, kEglSoftwareName, kEglName, kAutoName}) {
    if (name == known) return;
  }
  throw InputError("--gl " + name + ": expected software, osmesa, egl-software, egl or auto");
}

std::string Described(const GlChoice& choice) {
  return fmt::format("{} ({})", choice.library, choice.device);
}

GlChoice ChooseGl(const std::string& name) {
  GlChoice choice;
  choice.library = Resolve(name, HasOsMesa);
  choice.device = DeviceOf(choice.library);
  if (IsSoftware(choice.device) && HasGpuDevice()) {
    choice.warning = HasGraphicsProcessor()
                         ? "images are rendered in software; --gl auto uses the GPU of this machine"
                         : "images are rendered in software: EGL cannot use the GPU of this machine";
  }
  return choice;
}

void UseGl(const std::string& name) {
  // This process will render, so it may load OSMesa.
  const GlKind kind = KindOf(Resolve(name, [] { return LoadOsMesa() != nullptr; }));
  GlKind before = GlKind::kUndecided;
  if (!g_kind.compare_exchange_strong(before, kind) && before != kind) {
    throw EnvironmentError(
        fmt::format("--gl {}: this process already renders with {}", name, NameOf(before)));
  }
  if (IsEgl()) {
    TheEgl();
  } else {
    Mesa();
  }
}

bool IsGlInMemory() { return !IsEgl(); }

std::string GlInUse() {
  GlContext context;
  return fmt::format("{} ({})", NameOf(g_kind), RendererName());
}

std::string UseGlAndDescribe(const std::string& name) {
  UseGl(name);
  std::string why;
  if (name == kAutoName && g_kind != GlKind::kEgl) {
    why = ": there is no GPU that EGL can use";
  } else if (g_kind == GlKind::kOsMesa) {
    return "";
  } else if (name == kSoftwareName) {
    why = ": OSMesa is not installed";
  }
  return fmt::format("renders with {}{}\n", GlInUse(), why);
}

GlContext::GlContext() {
  if (g_kind == GlKind::kUndecided) UseGl(kSoftwareName);
  if (IsEgl()) {
    const Egl& egl = TheEgl();
    egl.bind_api(EGL_OPENGL_API);  // affects only this thread
    context_ = egl.create(egl.display, egl.config, EGL_NO_CONTEXT, nullptr);
    if (!context_) throw EnvironmentError("EGL cannot create an OpenGL context");
  } else {
    context_ = Mesa().create(GL_RGBA, 24, 8, 0, nullptr);
    if (!context_) throw EnvironmentError("OSMesa cannot create an OpenGL context");
  }
  MakeCurrent();
}

GlContext::~GlContext() {
  if (IsEgl()) {
    TheEgl().make_current(TheEgl().display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    TheEgl().destroy(TheEgl().display, context_);
  } else {
    Mesa().destroy(context_);
  }
}

void GlContext::MakeCurrent() {
  const bool good = IsEgl()
                        ? TheEgl().make_current(TheEgl().display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)
                        : Mesa().make_current(context_, unused_, GL_UNSIGNED_BYTE, kUnused, kUnused);
  if (!good)
    throw EnvironmentError(IsEgl() ? "EGL cannot activate its OpenGL context"
                                   : "OSMesa cannot activate its OpenGL context");
}

void* GlFunction(const char* name) {
  return IsEgl() ? reinterpret_cast<void*>(TheEgl().function(name))
                 : reinterpret_cast<void*>(Mesa().function(name));
}

}  // namespace evalbus::viz
