// Stages of a task. Source: RoboEval's metrics page (task_stage_reached, subtask_progress).
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "metrics/sample/metrics_config.h"

namespace evalbus::metrics {

// A stage exists from its declaration or its first Set(). Its last Set() counts, so a stage can be withdrawn.
// Stages may be reached in any order. Progress is the number of stages reached / the highest existing index,
// so a gap in the numbering counts as a stage that is not reached.
class Stages {
 public:
  explicit Stages(std::vector<StageState> declared) : declared_(std::move(declared)) {
    std::sort(declared_.begin(), declared_.end(),
              [](const StageState& a, const StageState& b) { return a.index < b.index; });
    stages_ = declared_;
  }

  void Start() { stages_ = declared_; }

  void Set(int index, bool reached, double time) {
    auto stage =
        std::find_if(stages_.begin(), stages_.end(), [&](const StageState& s) { return s.index >= index; });
    if (stage == stages_.end() || stage->index != index)
      stage = stages_.insert(stage, StageState{.index = index, .name = {}});
    stage->reached = reached;
    if (reached && stage->reached_time < 0) stage->reached_time = time;
  }

  // The stages are sorted by ascending index.
  const std::vector<StageState>& stages() const { return stages_; }

  double progress() const {
    if (stages_.empty()) return 0;
    const auto reached =
        std::count_if(stages_.begin(), stages_.end(), [](const StageState& s) { return s.reached; });
    return static_cast<double>(reached) / stages_.back().index;
  }

 private:
  std::vector<StageState> declared_;
  std::vector<StageState> stages_;
};

}  // namespace evalbus::metrics
