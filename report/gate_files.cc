#include "report/gate_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/comparison_tables.h"
#include "report/page/markup.h"

namespace evalbus::report {
namespace {

using results::Gate;
using results::GateCriterion;
using results::GateVerdict;
using results::Word;

std::string MeanOrDash(const GateCriterion& criterion, double mean) {
  return std::isfinite(mean) ? results::MeanText(criterion, mean) : "-";
}

std::string LossOrDash(const GateCriterion& criterion, double loss, results::BoundFrom from) {
  return std::isfinite(loss) ? results::LossText(criterion, loss, from) : "-";
}

std::string Row(const GateCriterion& criterion) {
  using results::BoundFrom;
  return fmt::format("| {} | {} | {} | {} | {} | {} to {} | {} | {} |\n", Word(criterion.verdict),
                     MarkdownCell(criterion.what), MeanOrDash(criterion, criterion.baseline_mean),
                     MeanOrDash(criterion, criterion.mean),
                     std::isfinite(criterion.loss)
                         ? WithUnit(Fixed(criterion.loss, Decimals(std::abs(criterion.loss))), criterion.unit)
                         : "-",
                     LossOrDash(criterion, criterion.loss_lower, BoundFrom::kBelow),
                     LossOrDash(criterion, criterion.loss_upper, BoundFrom::kAbove),
                     WithUnit(fmt::format("{:.4g}", criterion.margin), criterion.unit), criterion.pairs);
}

}  // namespace

std::string GateJunit(const Gate& gate) {
  Markup xml;
  const std::string failures = std::to_string(std::ranges::count_if(
      gate.criteria, [](const GateCriterion& one) { return one.verdict != GateVerdict::kPass; }));
  const std::string tests = std::to_string(gate.criteria.size());
  const std::string suite = fmt::format("evalbus gate: {} against {}", gate.run, gate.baseline);
  xml.Element("testsuites", {{"name", suite}, {"tests", tests}, {"failures", failures}}, [&] {
    xml.Element("testsuite", {{"name", suite}, {"tests", tests}, {"failures", failures}}, [&] {
      for (const GateCriterion& criterion : gate.criteria) {
        xml.Element("testcase", {{"classname", "evalbus.gate"}, {"name", criterion.what}}, [&] {
          const std::string verdict = Word(criterion.verdict);
          if (criterion.verdict == GateVerdict::kPass) {
            xml.Element("system-out", {}, criterion.why);
          } else {
            xml.Element("failure", {{"type", verdict}, {"message", criterion.why}},
                        verdict + ": " + criterion.why);
          }
        });
      }
    });
  });
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + xml.str() + "\n";
}

std::string GateMarkdown(const Gate& gate) {
  std::string text = fmt::format("### {}: {} against {}\n\n{}\n\n", Word(gate.verdict),
                                 MarkdownCell(gate.run), MarkdownCell(gate.baseline), MarkdownCell(gate.why));
  text +=
      "| verdict | value | baseline | run | loss | bounds of the loss, rounded outward | margin | pairs |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (const GateCriterion& criterion : gate.criteria) text += Row(criterion);
  text +=
      "\n| task | pairs | baseline succeeded | run succeeded | only baseline | only run |\n"
      "|---|---|---|---|---|---|\n";
  for (const results::GateTask& task : gate.tasks) {
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n", MarkdownCell(task.name), task.pairs,
                        task.baseline_successes, task.successes, task.lost, task.gained);
  }
  if (!gate.remarks.empty()) text += "\n";
  for (const std::string& remark : gate.remarks) text += "- " + MarkdownCell(remark) + "\n";
  return text;
}

}  // namespace evalbus::report
