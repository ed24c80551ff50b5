// The files of the page: our own, which are compiled in, and three.js as Debian's libjs-three brings it.
#pragma once

#include <string>

#include "viz/web/server.h"

namespace evalbus::viz {

// A file by its name ("index.html"); 404 for any other, 500 with the fix where libjs-three is not installed.
WebAnswer PageFile(const std::string& name);

}  // namespace evalbus::viz
