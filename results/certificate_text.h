// Formats a certificate as text and as JSON.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "results/certificate.h"

namespace evalbus::results {

// Names of stages, by TASK/VARIATION and index.
using StageNames = std::map<std::string, std::map<int, std::string>>;

// Returns the result in one sentence, for example "Verdicts depend on the engine: 7 of 100 episodes flip
// between MuJoCo 2.2.2 and 3.3.3."
std::string Headline(const Certificate& certificate);

// CertificateText() returns the headline, tables and flipped seeds.
std::string CertificateText(const Certificate& certificate, const StageNames& stages);
nlohmann::ordered_json CertificateJson(const Certificate& certificate, const StageNames& stages);

}  // namespace evalbus::results
