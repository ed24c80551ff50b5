// evalbus watch: scores what a source measures, somebody else's simulator or a robot.
#include <memory>

#include "bus/host.h"
#include "cli/commands/commands.h"
#include "runner/run.h"

namespace evalbus::commands {

Action AddWatch(CLI::App* app) {
  const auto options = std::make_shared<runner::RunOptions>();
  options->episodes = 1;
  app->add_option("task", options->sim.task, "TASK[/VARIATION], or a task file")->required();
  app->add_option("--out", options->out, "run folder; default runs/TASK-VARIATION-source-DATE-TIME")
      ->type_name("FOLDER");
  app->add_option("--episodes", options->episodes, "end after so many; Ctrl-C ends it earlier")
      ->capture_default_str();
  app->add_option("--control-hz,--hz", options->sim.control_hz,
                  "ticks per second that scores are made of, 5 to 500")
      ->capture_default_str();
  app->add_option("--robot", options->sim.robot,
                  "robot of models/robots or robot description (YAML) instead of the task's own");
  app->add_option("--gripper", options->sim.gripper,
                  "ARM=open or ARM=closed, with commas: a gripper whose fingers the source does not measure")
      ->delimiter(',')
      ->allow_extra_args(false);
  app->add_option("--source-timeout-s", options->sim.source_timeout_s,
                  "a source that says nothing for so long has broken its episode off")
      ->capture_default_str();
  app->add_option("--after-success-s", options->sim.after_success_s,
                  "go on for so long after the first success, and see whether it holds")
      ->capture_default_str();
  app->add_option("--policy-name", options->policy_name,
                  "what results, videos and comparisons call who moves the robot; default: source");
  app->add_option("--video", options->video,
                  "cameras, with commas: record a video of each episode while the next one goes on")
      ->delimiter(',')
      ->allow_extra_args(false);
  app->add_option("--model-path", options->sim.model_path,
                  "folder to look for MJCF files in, e.g. a MuJoCo Menagerie")
      ->allow_extra_args(false);
  app->add_option("--url", options->url,
                  "bus of the source; default: that of EVALBUS_URL, else udpm://239.255.76.67:7667?ttl=0")
      ->type_name("URL");
  app->add_flag("--web", options->web, "show it in a browser ('evalbus web'); the page stays until Ctrl-C");
  AddLogLevel(app);
  GroupOptions(app, {{"Source", {"--url", "--robot", "--gripper", "--source-timeout-s", "--model-path"}},
                     {"Episodes", {"--episodes", "--control-hz", "--after-success-s"}},
                     {"Output", {"--out", "--policy-name", "--video", "--web", "--log-level"}}});
  return [options] {
    runner::Watch(*options);
    return 0;
  };
}

}  // namespace evalbus::commands
