// OpenGL without a screen: in software (OSMesa), or on a graphics processor (EGL). Both are loaded when they
// are first needed, so that programs start without them.
//
// A process draws with one of the two: MuJoCo finds OpenGL's functions through whichever library is loaded.
// In software equal models and states give equal bits on every machine with the same Mesa and vector
// instructions; a graphics processor rounds in its own way. What a policy saw is therefore drawn with OSMesa
// unless the user says otherwise, and run.json keeps what was said.
#pragma once

#include <string>

namespace evalbus::viz {

// "osmesa", "egl" or "auto": EGL where this machine has a graphics processor that it works with, else OSMesa.
// Throws InputError for another word, EnvironmentError where what was asked for is missing, and where this
// process draws with the other one already. Without a call it is OSMesa.
void UseGl(const std::string& name);
// "osmesa" or "egl": what `name` comes to on this machine. Loads nothing into this process.
std::string ResolveGl(const std::string& name);
// Whether contexts are memory alone, which a fork copies: OSMesa's.
bool IsGlInMemory();
// What this process draws with: "osmesa (llvmpipe (LLVM 15.0.6, 256 bits))". Throws as UseGl.
std::string GlInUse();
// Of commands that draw.
inline constexpr char kGlHelp[] =
    "what draws: osmesa, in software, with equal bytes everywhere; egl, where there is a GPU on it; auto: "
    "egl if\n"
    "there is a GPU that it works with, else osmesa";
// UseGl, and where it is not the usual one a line for people that says which it is, and why. Throws as UseGl.
std::string UseGlAndTell(const std::string& name);

// One context. It is current in the thread that made it or last called MakeCurrent. All throw
// EnvironmentError.
class GlContext {
 public:
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  void MakeCurrent();

 private:
  void* context_ = nullptr;
  // OSMesa insists on a buffer of its own; everything is drawn into others.
  static constexpr int kUnused = 16;
  unsigned char unused_[kUnused * kUnused * 4];
};

// A function of OpenGL's. A context is current.
void* GlFunction(const char* name);

}  // namespace evalbus::viz
