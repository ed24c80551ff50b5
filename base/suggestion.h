// Suggestions for misspelled names in error messages: commands, options, keys, tasks, policies, cameras, ...
#pragma once

#include <string>
#include <vector>

namespace evalbus {

// Returns the candidate that `name` most likely misspells or abbreviates; empty if there is none.
std::string NearestName(const std::string& name, const std::vector<std::string>& candidates);

// Returns "a, b, c": each name once, in alphabetical order, without empty names.
std::string ListOf(std::vector<std::string> names);

// Returns "; did you mean 'x'?" if a candidate is similar. Otherwise returns "; expected one of a, b, c"
// (empty if there are no candidates), or `otherwise` if it is given.
std::string Suggestion(const std::string& name, const std::vector<std::string>& candidates);
std::string Suggestion(const std::string& name, const std::vector<std::string>& candidates,
                       const std::string& otherwise);

}  // namespace evalbus
