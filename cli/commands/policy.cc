// Implements `evalbus policy`, which lists and shows contracts, checks whether a server fulfills a contract,
// and serves LeRobot checkpoints.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/json_file.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "cli/commands/python_module.h"
#include "cli/commands/scene_words.h"
#include "policy_bridge/policy_options.h"
#include "policy_bridge/remote/policy_check.h"
#include "runner/training_starts.h"
#include "sim/prepared_scene.h"
#include "sim/world.h"
#include "viz/images/png.h"
#include "viz/images/renderer.h"
#include "viz/images/view_image.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using policy::CheckLine;
using policy::CheckReport;
using policy::Contract;
using policy::ObservationEntry;

struct PolicyCommandOptions {
  const CLI::App* list = nullptr;
  const CLI::App* show = nullptr;
  const CLI::App* check = nullptr;
  const CLI::App* serve = nullptr;
  // Checkpoint for `serve`. The Python module parses the other options of `serve`.
  std::string lerobot;
  policy::PolicyOptions policy;
  sim::SimOptions sim;
  int64_t seed = 0;
  std::optional<double> first_step_rad;
  fs::path out;
  bool json = false;
};

// Returns the exit code of `check`. The codes 3 to 6 are specific to this command.
int ExitCode(CheckReport::Verdict verdict) {
  using Verdict = CheckReport::Verdict;
  return verdict == Verdict::kGood          ? 0
         : verdict == Verdict::kUnreachable ? 3
         : verdict == Verdict::kProtocol    ? 4
         : verdict == Verdict::kContract    ? 5
                                            : 6;
}

int ListContracts() {
  std::vector<Lines> rows = {{"CONTRACT", "WIRE", "HZ", "ACTION", "IMAGES", "WHAT"}};
  for (const Contract& contract : policy::AllContracts()) {
    const auto images = std::ranges::count_if(contract.observation, &ObservationEntry::is_image);
    rows.push_back({contract.name, policy::NameOf(contract.wire), fmt::format("{:g}", contract.rate_hz),
                    policy::NameOf(contract.actions.kind), std::to_string(images), contract.description});
  }
  PrintTable(rows);
  fmt::print(
      "\n'evalbus policy show CONTRACT' shows one, 'evalbus policy check CONTRACT' checks its server, and\n"
      "'evalbus run TASK --policy CONTRACT' evaluates it. CONTRACT can also be your own file\n"
      "(docs/connecting_a_policy.md).\n");
  return 0;
}

std::string InWords(const ObservationEntry& entry) {
  using Source = ObservationEntry::Source;
  switch (entry.source) {
    case Source::kCamera:
    case Source::kDepth: {
      const policy::ImageForm& form = entry.image;
      std::string words =
          fmt::format("{} of camera {}, {} x {}", entry.source == Source::kDepth ? "depth" : "image",
                      form.view.camera, form.view.width_px, form.view.height_px);
      if (form.view.fovy_deg > 0) words += fmt::format(", field of view {:g} deg", form.view.fovy_deg);
      if (!form.view.shadows) words += ", no shadows";
      if (form.rotate_deg != 0) words += fmt::format(", rotated by {} deg", form.rotate_deg);
      if (form.mirror) words += ", mirrored";
      if (form.width_px > 0) {
        words +=
            fmt::format(", {} to {} x {}", form.pad ? "padded" : "stretched", form.width_px, form.height_px);
      }
      if (form.bgr) words += ", BGR";
      if (form.chw) words += ", channels first";
      return words;
    }
    case Source::kState:
      return Plural(entry.signals.size(), "signal");
    case Source::kPrompt:
      return "the task's instruction";
    case Source::kConstant:
      return policy::Describe(entry.constant);
    case Source::kCounter:
      return entry.counter == ObservationEntry::Counter::kEpisode ? "index of the episode"
             : entry.counter == ObservationEntry::Counter::kTick  ? "control tick of the episode"
                                                                  : "number of previous observations";
    case Source::kCommitted:
      return entry.committed == ObservationEntry::Committed::kActions
                 ? "actions of the last chunk that are left to execute"
                 : "number of actions that are executed before the answer arrives";
  }
  return "";
}

int Show(const PolicyCommandOptions& options) {
  const Contract contract = policy::FindContract(options.policy.policy);
  fmt::print("{}\n{}\n\n", contract.name, contract.description);
  PrintSection("Server", {fmt::format("{}, wire {}", contract.url, policy::NameOf(contract.wire))});
  PrintSection("Rate",
               {fmt::format("{:g} Hz; {} of each action chunk ({:.3g} s) {} executed", contract.rate_hz,
                            Plural(contract.execute_steps, "step"), contract.execute_steps / contract.rate_hz,
                            contract.execute_steps == 1 ? "is" : "are")});
  Lines seen;
  for (const ObservationEntry& entry : contract.observation) {
    seen.push_back(fmt::format("{}: {}", entry.KeyText(), InWords(entry)));
    for (const policy::Signal& signal : entry.signals) seen.push_back("    " + signal.name);
  }
  PrintSection("Observation", seen);
  Lines lines = {
      fmt::format("{}, {} values", policy::NameOf(contract.actions.kind), contract.actions.num_values)};
  for (const policy::ArmForm& arm : contract.actions.arms) {
    std::string words = fmt::format("arm {}: values {}", arm.arm, fmt::join(arm.indices, ", "));
    if (arm.gripper.index) {
      words += fmt::format(", gripper value {} ({:g} open, {:g} closed)", *arm.gripper.index,
                           arm.gripper.open, arm.gripper.closed);
    }
    lines.push_back(words);
  }
  PrintSection("Action", lines);
  if (contract.is_privileged())
    PrintSection("Privileged", {"the observation contains poses that a real robot cannot measure"});
  return 0;
}

// The first observation of an episode, with its images.
struct FirstLook {
  sim::PreparedScene prepared;
  state_t state{};
  std::vector<image_t> images;
};

FirstLook Look(const PolicyCommandOptions& options, const Contract& contract) {
  sim::SimOptions sim = options.sim;
  sim.control_hz = contract.rate_hz;
  FirstLook look;
  look.prepared = sim::ComposeScene(sim);
  const sim::PreparedScene& scene = look.prepared;
  sim::World world(scene.scene.physics.get(), scene.info, scene.robot, scene.task, scene.info.substeps);
  world.Reset(options.seed, scene.task.variation(scene.variation));
  world.Fill(&look.state);
  return look;
}

void Draw(const PolicyCommandOptions& options, const policy::ObservationBuilder& observations,
          FirstLook* look) {
  if (observations.views().empty()) return;
  viz::Renderer renderer(std::move(look->prepared.scene.visual), viz::kUsualViewSize);
  renderer.SetAppearance(look->prepared.info, options.seed);
  renderer.SetState(look->state);
  for (const view_t& view : observations.views()) {
    viz::CheckView(view, renderer.model());
    look->images.push_back({});
    viz::DrawView(view, look->state.header, &renderer, &look->images.back());
  }
}

// Writes the images as they were sent into a folder. Returns their files.
std::vector<std::string> WriteImages(const policy::ObservationBuilder& observations, const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& sent : observations.ImagesSent()) {
    const size_t rows = sent.is_chw ? 1 : 0;
    viz::Frame frame(
        {static_cast<int>(sent.array.shape.at(rows + 1)), static_cast<int>(sent.array.shape.at(rows))});
    const size_t plane = static_cast<size_t>(frame.size.width) * static_cast<size_t>(frame.size.height);
    for (size_t i = 0; i < plane; ++i) {
      for (size_t c = 0; c < 3; ++c) {
        const size_t from = sent.is_chw ? c * plane + i : 3 * i + c;
        // The data are interpreted as RGB, so that swapped channels are visible.
        frame.bgrx[4 * i + (2 - c)] = sent.array.data.at(from);
      }
    }
    std::string name = sent.key;
    std::ranges::replace(name, '/', '_');
    const fs::path file = folder / (name + ".png");
    viz::WritePng(frame, file);
    files.push_back(file.string());
  }
  return files;
}

// images: files of the images as they were sent.
void Print(const CheckReport& report, const std::vector<std::string>& images) {
  constexpr const char* kMarks[] = {"ok  ", "    ", "?   ", "BAD "};
  for (const CheckLine& line : report.lines) {
    // A line of the report may contain a server's traceback with many lines.
    std::istringstream text(line.text);
    const char* mark = kMarks[static_cast<int>(line.level)];
    for (std::string part; std::getline(text, part); mark = "    ")
      fmt::print("{}{}\n", mark, Printable(part));
  }
  if (!images.empty()) fmt::print("    images as they were sent: {}\n", fmt::join(images, ", "));
  using Verdict = CheckReport::Verdict;
  const char* const words =
      report.verdict == Verdict::kGood          ? "good: no problem was found"
      : report.verdict == Verdict::kUnreachable ? "unreachable: no server answers"
      : report.verdict == Verdict::kProtocol
          ? "protocol: the server does not support this wire protocol, or failed"
      : report.verdict == Verdict::kContract
          ? "contract: the server's answers contradict the contract"
          : "suspicious: the server works, but a mistake is likely; see the lines with '?'";
  fmt::print("\n{}\n", words);
}

int Check(PolicyCommandOptions options) {
  std::optional<Contract> contract = policy::FindContractOf(options.policy);
  if (!contract)
    throw InputError(
        options.policy.policy +
        ": expected a contract ('evalbus policy list' lists the built-in ones) or ws://HOST:PORT");
  if (options.first_step_rad) contract->first_step_rad = options.first_step_rad;
  // Throws InputError if a set does not exist, as a run does.
  if (!contract->trained_on.empty()) runner::TrainingStarts::Of(*contract);
  FirstLook look = Look(options, *contract);
  const mjModel& model = *look.prepared.scene.physics;
  policy::ObservationBuilder observations = policy::Fitted(
      *contract, [&] { return policy::ObservationBuilder(*contract, model, look.prepared.info); });
  Draw(options, observations, &look);
  const auto client = policy::MakePolicyClient(policy::ClientOptionsOf(*contract));
  if (!options.json)
    fmt::print("{}: {} at {}\n\n", contract->name, policy::NameOf(contract->wire), contract->url);
  std::fflush(stdout);
  const CheckReport report = policy::CheckPolicyServer(*contract, client.get(), model, look.prepared.info,
                                                       look.state, look.images, &observations);
  const fs::path folder = options.out.empty() ? fs::path("policy_check") / contract->name : options.out;
  fs::create_directories(folder);
  const std::vector<std::string> images = WriteImages(observations, folder);
  WriteWhole(folder / "check.json", ToText(policy::CheckJson(*contract, report), 2) + "\n");
  if (options.json) {
    fmt::print("{}\n", ToText(policy::CheckJson(*contract, report), 2));
  } else {
    Print(report, images);
  }
  return ExitCode(report.verdict);
}

}  // namespace

Action AddPolicy(CLI::App* app) {
  const auto options = std::make_shared<PolicyCommandOptions>();
  options->sim.task = "lift_pot";
  app->require_subcommand(1);
  options->list = app->add_subcommand("list", "list the built-in contracts");
  CLI::App* show = app->add_subcommand(
      "show", "show the observation that a policy receives, and the meaning of its actions");
  show->add_option("contract", options->policy.policy, "name or YAML file of a contract")->required();
  options->show = show;
  CLI::App* check = app->add_subcommand("check",
                                        "send one observation to a policy server and check its answers; exit "
                                        "codes: 0 good, 3 unreachable, 4 protocol, 5 contract, 6 suspicious");
  check
      ->add_option("contract", options->policy.policy,
                   "name or YAML file of a contract; or ws://HOST:PORT with --contract")
      ->required();
  check->add_option("--contract", options->policy.contract,
                    "name or YAML file of the contract of the server at ws://HOST:PORT");
  check->add_option("--task", options->sim.task, "task that the observation is taken from")
      ->capture_default_str();
  check->add_option("--robot", options->sim.robot,
                    "name or YAML file of a robot to use instead of the task's own");
  AddModelSources(check, &options->sim.model_path, &options->sim.assets);
  check->add_option("--seed", options->seed, "seed of the episode")->capture_default_str();
  check
      ->add_option(
          "--first-step", options->first_step_rad,
          "maximum distance of the first action from the robot's position, rad; default: the contract's "
          "first_step_rad, otherwise 0.5. Increase it if the policy is meant to begin with a large step")
      ->type_name("RAD")
      ->check(InRange(1e-6, 100.0));
  check->add_option("--out", options->out, "folder for images and check.json; default policy_check/CONTRACT");
  check->add_flag("--json", options->json, "print check.json instead of text");
  options->check = check;
  CLI::App* serve = app->add_subcommand(
      "serve", "serve a LeRobot checkpoint; requires LeRobot; --contract FILE writes a proposed contract");
  serve->add_option("--lerobot", options->lerobot, "folder of the checkpoint")
      ->type_name("CHECKPOINT")
      ->required();
  serve->allow_extras();
  serve->footer("More options: --port, --host, --device, --contract, --rate-hz, --image (docs/lerobot.md)");
  options->serve = serve;
  return [options] {
    if (options->serve->parsed()) {
      std::vector<std::string> arguments = {options->lerobot};
      const std::vector<std::string> more = options->serve->remaining();
      arguments.insert(arguments.end(), more.begin(), more.end());
      ExecPythonModule("evalbus.lerobot.policy", arguments);
    }
    if (options->list->parsed()) return ListContracts();
    if (options->show->parsed()) return Show(*options);
    return Check(*options);
  };
}

}  // namespace evalbus::commands
