// Suggestions for misspelled names in error messages: commands, options, keys, tasks, policies, cameras, ...
#pragma once

#include <string>
#include <vector>

namespace evalbus {

// The candidate that `name` is most likely a misspelling of, or empty.
std::string NearestName(const std::string& name, const std::vector<std::string>& candidates);

// "a, b, c": each candidate once, in alphabetical order, without empty ones.
std::string ListOf(std::vector<std::string> names);

// "; did you mean 'x'?" if there is such a candidate, else "; expected one of a, b, c", or `otherwise` if
// given.
std::string Suggestion(const std::string& name, const std::vector<std::string>& candidates);
std::string Suggestion(const std::string& name, const std::vector<std::string>& candidates,
                       const std::string& otherwise);

}  // namespace evalbus
