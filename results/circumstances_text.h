// Formats the influence of start parameters on success as text and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/circumstances.h"

namespace evalbus::results {

// Returns one sentence per parameter that significantly influences success, most significant first. For
// example "Success falls from 85 % (51 of 60) to 38 % (15 of 40) where pot y is above 0.100 m (p = 0.002; 6
// parameters tested)." If there is no such parameter, returns one sentence that reports its absence.
std::vector<std::string> CircumstanceSentences(const RunCircumstances& run);

// Formats a value in the parameter's display unit, with enough decimals for the range of its values. The
// parameter must not be a choice.
std::string ParameterText(const Circumstance& parameter, double value);
// Returns a range such as "0.100 to 0.150 m", "present" or "absent" for NAME_present, or the name of a
// choice.
std::string BinText(const Circumstance& parameter, const CircumstanceBin& bin);

// Returns the sentences, a table of all parameters, and the rates by value of each significant parameter.
std::string CircumstancesText(const RunCircumstances& run, bool colors);

nlohmann::ordered_json CircumstancesJson(const std::vector<RunCircumstances>& runs);

}  // namespace evalbus::results
