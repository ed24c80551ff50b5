// For LD_AUDIT: the dynamic loader does not find OSMesa, as on a machine without it.
#include <link.h>

#include <cstring>

extern "C" unsigned la_version(unsigned) { return LAV_CURRENT; }

extern "C" char* la_objsearch(const char* name, uintptr_t*, unsigned) {
  // A path that does not exist. If nullptr is returned, glibc 2.36 sometimes reports "wrong ELF class"
  // without a file.
  static char nowhere[] = "/nowhere/libOSMesa.so.8";
  return std::strstr(name, "libOSMesa") ? nowhere : const_cast<char*>(name);
}
