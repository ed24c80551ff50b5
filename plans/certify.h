// Runs the same plan on several engines (versions of MuJoCo) and compares the results, for `evalbus certify`.
//
// The folder OUT contains certificate.json and, for each engine, a plan's folder OUT/VERSION.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plans/plan.h"
#include "results/certificate_text.h"

namespace evalbus::plans {

inline constexpr char kCertificateJson[] = "certificate.json";

// Finds the engines of --engines, for example {"2.2", "3.3.3"}. The first engine is the reference. Throws
// InputError if an engine is not built or given twice, or if there are fewer than two engines.
std::vector<std::string> FindEngines(const std::vector<std::string>& wanted);

struct Certified {
  results::Certificate certificate;
  results::StageNames stages;
};

// Runs the missing episodes of the plan on each engine, at most `workers` runs at a time, compares them, and
// writes OUT/certificate.json. Throws InputError, for example if OUT belongs to another plan, and
// EnvironmentError.
Certified CertifyPlan(const Plan& plan, const std::vector<std::string>& engines,
                      const std::filesystem::path& out, int workers);

}  // namespace evalbus::plans
