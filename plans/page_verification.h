// Checks the report pages and comparisons in a folder of results: makes each again from the runs, and
// compares.
#pragma once

#include <filesystem>

#include "results/verification.h"

namespace evalbus::plans {

// Adds a finding for each page, and each file of `evalbus compare --json`, that does not follow from its
// runs; it names the first text or number that differs. Covers this folder and all results folders below it.
// Throws InputError if the folder is not one of results.
void VerifyPages(const std::filesystem::path& folder, results::Verification* result);

}  // namespace evalbus::plans
