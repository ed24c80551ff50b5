// Explains how an episode ended, as data and as text.
#pragma once

#include <string>

#include "evalbus/explanation_t.hpp"
#include "metrics/episode/failure_reason.h"
#include "metrics/episode/rollout_metrics.h"
#include "metrics/sample/grasps.h"

namespace evalbus::metrics {

// First contact of the robot with the scene; tick 0: none.
struct FirstCollision {
  int64_t tick = 0;
  SceneContact contact{};
};

// The text of the result is one sentence. It contains how and when the episode ended, the deciding
// conditions, the highest stage, the first collision, slips, and violations of force limits.
explanation_t Explain(const EpisodeOutcome& outcome, const CauseEnd& end, const RolloutMetrics& metrics,
                      const FirstCollision& collision, const std::vector<GraspInterval>& grasps,
                      const std::vector<limit_violation_t>& violations);

}  // namespace evalbus::metrics
