// For LD_AUDIT: the dynamic loader finds neither OSMesa nor, if HIDE_EGL is set, EGL. This simulates a
// machine without them.
#include <link.h>

#include <cstdlib>
#include <cstring>

extern "C" unsigned la_version(unsigned) { return LAV_CURRENT; }

extern "C" char* la_objsearch(const char* name, uintptr_t*, unsigned) {
  // These paths do not exist. A nullptr would sometimes make glibc 2.36 report "wrong ELF class" without a
  // file name.
  static char no_osmesa[] = "/nowhere/libOSMesa.so.8", no_egl[] = "/nowhere/libEGL.so.1";
  if (std::strstr(name, "libOSMesa")) return no_osmesa;
  if (std::strstr(name, "libEGL") && std::getenv("HIDE_EGL")) return no_egl;
  return const_cast<char*>(name);
}
