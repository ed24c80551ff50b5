// For LD_AUDIT: with it the dynamic loader does not find OSMesa, as on a machine that has none.
#include <link.h>

#include <cstring>

extern "C" unsigned la_version(unsigned) { return LAV_CURRENT; }

extern "C" char* la_objsearch(const char* name, uintptr_t*, unsigned) {
  // A place where nothing is: after a nullptr glibc 2.36 now and then says "wrong ELF class" of no file at
  // all.
  static char nowhere[] = "/nowhere/libOSMesa.so.8";
  return std::strstr(name, "libOSMesa") ? nowhere : const_cast<char*>(name);
}
