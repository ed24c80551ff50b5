// Implements `evalbus watch`, which scores episodes of a source, such as an external simulator or a robot.
#include <memory>

#include "base/arguments.h"
#include "base/help.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "cli/commands/scene_words.h"
#include "runner/run.h"

namespace evalbus::commands {

Action AddWatch(CLI::App* app) {
  const auto options = std::make_shared<runner::RunOptions>();
  options->episodes = 1;
  app->add_option("task", options->sim.task, "TASK[/VARIATION], or a task file")->required();
  app->add_option("--out", options->out, "run folder; default runs/TASK-VARIATION-source-DATE-TIME")
      ->type_name("FOLDER");
  app->add_option("--episodes", options->episodes,
                  "number of episodes after which to stop; Ctrl-C stops earlier")
      ->capture_default_str();
  app->add_option("--control-hz,--hz", options->sim.control_hz,
                  "rate at which the source is sampled for scores, 5 to 500")
      ->capture_default_str();
  app->add_option(
      "--robot", options->sim.robot,
      "robot that replaces the task's own: a name in models/robots, or a robot description (YAML)");
  AddList(app, "--gripper", &options->sim.gripper,
          "ARM=open or ARM=closed, separated by commas: state of grippers whose fingers the source "
          "does not measure");
  app->add_option("--contacts", options->sim.contacts,
                  "where contacts come from: shapes (the collision checker) or source (the source publishes "
                  "them)")
      ->type_name("shapes|source")
      ->capture_default_str();
  app->add_option("--map", options->sim.map,
                  "YAML file with the source's names of joints, objects and contacts, zeros of joints and "
                  "frames of objects, where they differ from the task's")
      ->type_name("FILE");
  app->add_option("--source-timeout-s", options->sim.source_timeout_s,
                  "an episode is aborted if its source sends nothing for this long")
      ->capture_default_str();
  app->add_option("--after-success-s", options->sim.after_success_s,
                  "continue for this long after the first success, to check that the success lasts")
      ->capture_default_str();
  app->add_option("--policy-name", options->policy_name,
                  "name of the policy in results, videos and comparisons; default: source");
  AddList(app, "--video", &options->video,
          "cameras, separated by commas: record a video of each episode while the next one runs");
  AddModelSources(app, &options->sim.model_path, &options->sim.assets);
  app->add_option(
         "--url", options->url,
         "bus of the source; default: the value of EVALBUS_URL, otherwise udpm://239.255.76.67:7667?ttl=0")
      ->type_name("URL");
  app->add_option("--operator", options->judged_by,
                  "name of the person who gives a verdict on each episode after its end, on a page that does "
                  "not show\nthe score ('evalbus judge'); results are printed when all episodes are judged")
      ->type_name("NAME");
  app->add_flag("--web", options->web,
                "show the run in a browser ('evalbus web'); the page stays available until Ctrl-C");
  AddLogLevel(app);
  GroupOptions(
      app, {{"Source",
             {"--url", "--robot", "--gripper", "--contacts", "--map", "--source-timeout-s", "--model-path",
              "--assets"}},
            {"Episodes", {"--episodes", "--control-hz", "--after-success-s"}},
            {"Output", {"--out", "--policy-name", "--video", "--operator", "--web", "--log-level"}}});
  return [options] {
    runner::Watch(*options);
    return 0;
  };
}

}  // namespace evalbus::commands
