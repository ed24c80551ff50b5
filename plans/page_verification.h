// Checks the report pages and comparisons in a folder of results, by regenerating each of them from the runs.
#pragma once

#include <filesystem>

#include "results/verification.h"

namespace evalbus::plans {

// Adds a finding for each page and each file of `evalbus compare --json` that differs from the newly
// generated one. The finding names the first text or number that differs. Covers this folder, which must be a
// results folder, and all results folders below it. Pages of other versions of evalbus are only noted.
void VerifyPages(const std::filesystem::path& folder, results::Verification* result);

}  // namespace evalbus::plans
