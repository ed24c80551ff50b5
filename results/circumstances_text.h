// The influence of start parameters on success as text for people, and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/circumstances.h"

namespace evalbus::results {

// One sentence per parameter that is shown to influence success, most significant first, for example "Success
// falls from 85 % to 38 % where pot y is above 0.100 m (p = 0.002; 6 parameters tested)."; otherwise one
// sentence that none is.
std::vector<std::string> CircumstanceSentences(const RunCircumstances& run);

// A value of a parameter that is not a choice in its display unit, with enough decimals for the range of its
// values.
std::string ParameterText(const Circumstance& parameter, double value);
// "0.100 to 0.150 m"; "present", "absent" for NAME_present; the name of a choice.
std::string BinText(const Circumstance& parameter, const CircumstanceBin& bin);

// Sentences, a table of the parameters, and the rates of those that are shown.
std::string CircumstancesText(const RunCircumstances& run, bool colors);

nlohmann::ordered_json CircumstancesJson(const std::vector<RunCircumstances>& runs);

}  // namespace evalbus::results
