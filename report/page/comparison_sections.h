// Functions that write the sections of a comparison's page.
#pragma once

#include "report/page/comparison_page.h"
#include "report/page/markup.h"

namespace evalbus::report {

// Writes the success rates of both sides and their difference, by task and over all tasks.
void WriteSuccess(const results::Comparison& comparison, Markup* html);
// Writes the outcomes of both sides by seed. A table lists the seeds where only one side succeeded, with
// causes and links to the 3D viewer. heading: HTML element of the heading, for example "h2".
void WriteSeeds(const ComparisonPageParts& parts, const results::Comparison& comparison,
                const results::TaskComparison& task, const char* heading, Markup* html);
// Writes the compared metrics with their relative changes on one axis.
void WriteMetrics(const results::Comparison& comparison, const results::TaskComparison& task,
                  const char* heading, Markup* html);

}  // namespace evalbus::report
