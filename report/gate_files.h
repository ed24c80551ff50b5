// Formats a gate's decision for CI systems and pull requests.
#pragma once

#include <string>

#include "results/gate.h"

namespace evalbus::report {

// Returns JUnit XML with one test case per criterion. FAIL and CANNOT TELL are reported as failures of the
// type "FAIL" or "CANNOT TELL".
std::string GateJunit(const results::Gate& gate);

// Returns a summary in GitHub's Markdown: verdict, table of the criteria, table of the tasks, and remarks.
std::string GateMarkdown(const results::Gate& gate);

}  // namespace evalbus::report
