// The sections of a comparison's page, one function each.
#pragma once

#include "report/page/comparison_page.h"
#include "report/page/markup.h"

namespace evalbus::report {

// The success rates of both sides and their difference, by task and over all tasks.
void WriteSuccess(const results::Comparison& comparison, Markup* html);
// The outcomes of both sides by seed, and the seeds where only one of them succeeded, with causes and links
// to the 3D viewer. heading: name of the heading's element.
void WriteSeeds(const ComparisonPageParts& parts, const results::Comparison& comparison,
                const results::TaskComparison& task, const char* heading, Markup* html);
// The main metrics with their relative changes on one axis.
void WriteMetrics(const results::Comparison& comparison, const results::TaskComparison& task,
                  const char* heading, Markup* html);

}  // namespace evalbus::report
