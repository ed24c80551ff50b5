// The files of the page as answers: our own, which are compiled in, and those of three.js.
#pragma once

#include <string>

#include "viz/web/server.h"

namespace evalbus::viz {

// index.html
extern const char* const kPageHtml;

// A file by its name ("index.html"); 404 for any other, 500 with the fix where libjs-three is not installed.
WebAnswer AnswerFile(const std::string& name);

}  // namespace evalbus::viz
