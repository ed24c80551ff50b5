#include "report/page/page.h"
#include "report/page/report_sections.h"

namespace evalbus::report {

void WriteOperators(const RunSection& section) {
  if (section.run.operators.empty()) return;
  section.html->Element("section", {{kUnchecked, ""}}, [&] {
    section.html->Element(section.heading, {{"id", section.id + "operators"}}, "Verdicts of operators");
    for (const std::string& sentence : section.run.operators) section.html->Element("p", {}, sentence);
  });
}

}  // namespace evalbus::report
