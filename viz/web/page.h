// HTTP responses with the files of the page: evalbus' own files, which are compiled into the program, and the
// files of three.js.
#pragma once

#include <string>

#include "viz/web/server.h"

namespace evalbus::viz {

// Content of index.html.
extern const char* const kPageHtml;

// Returns the file with this name, e.g. "index.html". Returns status 404 if there is none, and status 500
// with instructions if libjs-three is not installed.
WebAnswer AnswerFile(const std::string& name);

}  // namespace evalbus::viz
