// OpenGL contexts without a screen: in software (OSMesa, or EGL with Mesa's software renderer) or on a
// graphics processor (EGL). The libraries are loaded on first use, so that programs start without them.
//
// A process uses only one of these libraries, because MuJoCo looks up the OpenGL functions in whichever
// library is loaded. Software rendering of equal models and states gives identical bits on all machines with
// the same Mesa version and vector instructions. Results of graphics processors vary. Images for policies are
// therefore rendered in software unless the user selects EGL, and run.json records the selection.
#pragma once

#include <string>

namespace evalbus::viz {

// Throws InputError unless `name` is one of:
// - "software", the default: "osmesa" if it is installed, else "egl-software"; both give equal bytes
// - "osmesa", "egl-software": one of the two, e.g. to compare them
// - "egl": the first device in EGL's list that works, usually a graphics processor, else Mesa in software
// - "auto": "egl" if it works with a graphics processor of this machine, else "software"
void CheckGl(const std::string& name);
// Selects the library. If it is not called, "software" is used. Throws the errors of CheckGl(), and
// EnvironmentError if the selected library is missing or this process already draws with a different library.
void UseGl(const std::string& name);
// The renderer of a run.
struct GlChoice {
  std::string library;  // "osmesa", "egl-software" or "egl"
  std::string device;   // e.g. "llvmpipe (LLVM 15.0.6, 256 bits)"
  // Warning for the user if software renders although this machine has a GPU; otherwise empty.
  std::string warning;
};
// Returns library and device, e.g. "osmesa (llvmpipe (LLVM 15.0.6, 256 bits))".
std::string Described(const GlChoice& choice);
// Returns the renderer that `name` selects on this machine. Loads no library into this process. Throws the
// errors of UseGl().
GlChoice ChooseGl(const std::string& name);
// Returns whether a fork copies contexts, because they consist of process memory only. True for OSMesa.
bool IsGlInMemory();
// Returns a description of the renderer in use, e.g. "osmesa (llvmpipe (LLVM 15.0.6, 256 bits))". Throws the
// errors of UseGl().
std::string GlInUse();
// Help text of the --gl option of commands that render images.
inline constexpr char kGlHelp[] =
    "renderer: software (equal bytes on every machine, with OSMesa or, where it is not installed, EGL);\n"
    "egl (on the GPU if there is one); auto (egl if it can use a GPU, otherwise software);\n"
    "osmesa, egl-software (this library)";
inline constexpr char kDefaultGl[] = "software";
// Calls UseGl. If OSMesa was not selected, or if "auto" found no GPU, returns a line for the user with the
// library and the reason. Throws the errors of UseGl().
std::string UseGlAndDescribe(const std::string& name);

// An OpenGL context. It is current in the thread that constructed it or last called MakeCurrent. The
// constructor and MakeCurrent throw EnvironmentError.
class GlContext {
 public:
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  void MakeCurrent();

 private:
  void* context_ = nullptr;
  // Default buffer, which OSMesa requires. It is unused, because everything is drawn into framebuffer
  // objects.
  static constexpr int kUnused = 16;
  unsigned char unused_[kUnused * kUnused * 4];
};

// Returns the address of an OpenGL function. A context must be current.
void* GlFunction(const char* name);

}  // namespace evalbus::viz
