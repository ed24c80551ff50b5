// For LD_AUDIT: with it the dynamic loader does not find OSMesa, as on a machine that has none.
#include <link.h>

#include <cstring>

extern "C" unsigned la_version(unsigned) { return LAV_CURRENT; }

extern "C" char* la_objsearch(const char* name, uintptr_t*, unsigned) {
  return std::strstr(name, "libOSMesa") ? nullptr : const_cast<char*>(name);
}
