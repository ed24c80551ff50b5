#include "runner/run_json.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/options_json.h"
#include "models/task_description.h"
#include "runner/prepared_run.h"

namespace evalbus::runner::run_json_test {

nlohmann::ordered_json Made(const RunOptions& options) {
  nlohmann::ordered_json json = {{"task", "lift_pot"}, {"variation", "position"}};
  json.update(OptionsJson(options));
  json["task_path"] = (TasksFolder() / "lift_pot.yaml/position").string();
  return json;
}

TEST(CommandOf, HasTheOptionsThatDiffer) {
  RunOptions options;
  options.episodes = 40;
  options.seed = 3;
  EXPECT_EQ(CommandOf(Made(options)), "evalbus run lift_pot/position --policy expert --episodes 40 --seed 3");
  options.policy.policy = "noisy_expert:0.1";
  options.sim.control_hz = 20;
  options.sim.realtime = true;
  options.sim.assets = {"a=x", "b=y"};
  // Neither option changes the results, so the command omits both.
  options.workers = 4;
  options.in_process = true;
  EXPECT_EQ(
      CommandOf(Made(options)),
      "evalbus run lift_pot/position --policy noisy_expert:0.1 --episodes 40 --seed 3 --assets a=x --assets "
      "b=y --control-hz 20.0 --realtime");
}

// A run without images can get videos later, with any rendering library that is installed by then.
TEST(CheckFixedOptions, ComparesTheLibraryOnlyIfItWasUsed) {
  RunOptions options;
  options.gl = "software";
  nlohmann::ordered_json before = Made(options);
  options.gl = "osmesa";
  EXPECT_NO_THROW(CheckFixedOptions("run.json", before, options));
  before["renderer"] = "OSMesa";
  EXPECT_THROW(CheckFixedOptions("run.json", before, options), InputError);
}

TEST(CommandOf, IsEmptyForWhatWasNotSimulated) {
  nlohmann::ordered_json json = Made({});
  json["watch"] = true;
  EXPECT_EQ(CommandOf(json), "");
  json["watch"] = false;
  json["source"] = "file";
  EXPECT_EQ(CommandOf(json), "");
}

}  // namespace evalbus::runner::run_json_test
