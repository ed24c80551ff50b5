#include "metrics/episode/cause.h"

#include "lcmtypes/end_reason.h"

namespace evalbus::metrics {

cause_t FindCause(const EpisodeOutcome& outcome, const std::string& reason, const explanation_t& explanation,
                  double end_s) {
  cause_t cause{};
  cause.kind = reason.empty() ? end_reason::kSuccess : "missed_condition";
  cause.tick = outcome.last_tick;
  cause.time_s = end_s;
  cause.text = explanation.text;
  return cause;
}

}  // namespace evalbus::metrics
