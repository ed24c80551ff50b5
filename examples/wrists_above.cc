// Example of a custom metric: the height of the lower wrist above an object. A task that lists it reports it,
//   target_distance:
//     clearance_of_wrists: {wrists_above: {object: pot}}
// and with a limit it is a predicate, for stages and verdicts: {wrists_above: {object: pot, min_m: 0.1}}.
#include <algorithm>
#include <limits>
#include <memory>

#include "base/plugins.h"
#include "metrics/task/expressions.h"

namespace {

using namespace evalbus;

class WristsAbove : public metrics::Quantity {
 public:
  WristsAbove(const YamlMap& arguments, const metrics::CompileContext& context)
      : body_(context.names.Body(arguments["object"].Text(), arguments["object"].location())) {
    subject_ = arguments["object"].Text();
    words_ = "height of the lower wrist above " + subject_;
  }
  double Evaluate(const metrics::WorldView& world) override {
    double lowest = std::numeric_limits<double>::infinity();
    for (const arm_state_t& arm : world.state.arm) lowest = std::min(lowest, arm.wrist_position_m[2]);
    return lowest - world.state.body[body_].position_m[2];
  }

 private:
  int body_;
};

}  // namespace

EVALBUS_PLUGIN {
  metrics::RegisterQuantity({"wrists_above",
                             {"object"},
                             {},
                             "m",
                             "m",
                             kAnyNumber,
                             condition_t::PROGRESS,
                             [](const YamlMap& arguments, const metrics::CompileContext& context) {
                               return std::make_unique<WristsAbove>(arguments, context);
                             }});
}
