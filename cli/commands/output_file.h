// Checks the names of files that a command writes.
#pragma once

#include <string>

namespace evalbus::commands {

// Returns an error if the name is that of an existing file of a run, a suite or a plan, such as its
// episodes.jsonl or the log of an episode, which the command would replace. Otherwise returns an empty
// string, as CLI::Option::check() expects.
std::string CheckOutputFile(const std::string& name);

}  // namespace evalbus::commands
