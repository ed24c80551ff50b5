// Files about a gate's decision for other programs: for CI systems and pull requests.
#pragma once

#include <string>

#include "results/gate.h"

namespace evalbus::report {

// JUnit XML: one test case per criterion. FAIL and CANNOT TELL are failures, of the type "FAIL" or "CANNOT
// TELL".
std::string GateJunit(const results::Gate& gate);

// A summary in GitHub's Markdown: verdict, table of the criteria, table of the tasks, remarks.
std::string GateMarkdown(const results::Gate& gate);

}  // namespace evalbus::report
