// Implements `evalbus env`, which serves a task as an environment to the program that starts it, such as
// Python with python/evalbus/environment.py.
//
// Messages in both directions are frames: the size as 4 bytes, little endian, followed by the message in
// MessagePack, with arrays as in openpi. docs/environment.md describes the messages.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/reserved_stdout.h"
#include "base/run_layout.h"
#include "cli/commands/commands.h"
#include "cli/commands/scene_words.h"
#include "lcmtypes/clock.h"
#include "policy_bridge/wire/codecs.h"
#include "runner/environment.h"
#include "runner/json_events.h"
#include "runner/version.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::commands {
namespace {

using policy::Map;
using policy::Value;

// Maximum size of a request. The largest requests contain an action.
constexpr uint32_t kMaxRequestBytes = 16 << 20;

struct EnvOptions {
  runner::EnvironmentOptions environment;
  std::string image_size = "224x224";
};

// Returns false if the input has ended before the first byte. Throws InputError if it ends later, and
// EnvironmentError if it cannot be read.
bool ReadInputBytes(void* data, size_t size) {
  size_t filled = 0;
  while (filled < size) {
    const ssize_t got = read(STDIN_FILENO, static_cast<char*>(data) + filled, size - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw EnvironmentError(std::string("standard input: ") + std::strerror(errno));
    if (got == 0 && filled == 0) return false;
    if (got == 0) throw InputError("standard input ends within a frame");
    filled += static_cast<size_t>(got);
  }
  return true;
}

// Returns the next request; nullopt at the end of the input.
std::optional<Value> ReadRequest() {
  uint8_t header[4];
  if (!ReadInputBytes(header, sizeof header)) return std::nullopt;
  const uint32_t size = header[0] | header[1] << 8 | header[2] << 16 | static_cast<uint32_t>(header[3]) << 24;
  if (size > kMaxRequestBytes)
    throw InputError(
        fmt::format("standard input: a frame has {} bytes, expected at most {}", size, kMaxRequestBytes));
  policy::Bytes bytes(size);
  if (size > 0 && !ReadInputBytes(bytes.data(), size)) throw InputError("standard input ends within a frame");
  return policy::DecodeMsgpack(bytes);
}

void SendFrame(const Value& message, ReservedStdout* output) {
  const policy::Bytes bytes = policy::EncodeMsgpack(message, policy::ArrayKeys::kBytes);
  if (bytes.size() > std::numeric_limits<uint32_t>::max()) {
    throw InputError(fmt::format("the observation has {} bytes, expected at most {}", bytes.size(),
                                 std::numeric_limits<uint32_t>::max()));
  }
  const auto size = static_cast<uint32_t>(bytes.size());
  std::string frame;
  for (const int shift : {0, 8, 16, 24}) frame += static_cast<char>(size >> shift & 0xFF);
  frame.append(bytes.begin(), bytes.end());
  output->Write(frame);
}

Value Description(const runner::Environment& environment, const std::string& gl) {
  const model_info_t& model = environment.model();
  const policy::Contract& contract = environment.contract();
  const runner::ActionBounds bounds = runner::BoundsOf(contract.actions, model);
  const auto size = static_cast<int64_t>(bounds.lower.size());
  const viz::GlChoice renderer = contract.needs_images() ? viz::ChooseGl(gl) : viz::GlChoice();
  const std::string& rate = environment.changed_rate();
  return Map{{"schema_version", runner::kEventsVersion},
             {"evalbus_version", kVersion},
             {"task", model.task},
             {"variation", model.variation},
             {"robot", model.robot},
             {"instruction", contract.PromptFor(model.task, model.instruction)},
             {"control_hz", 1 / ControlPeriod(model)},
             {"time_limit_s", Seconds(model.time_limit_us)},
             {"contract", contract.text},
             {"renderer", contract.needs_images() ? viz::Described(renderer) : ""},
             {"warning", renderer.warning + (renderer.warning.empty() || rate.empty() ? "" : "; ") + rate},
             {"action_lower", policy::FloatArray(bounds.lower, {size})},
             {"action_upper", policy::FloatArray(bounds.upper, {size})}};
}

Value Answer(runner::Environment* environment, const Value& request) {
  runner::Environment::Step step;
  if (const Value* action = request.Find("step"); action && action->As<policy::Array>()) {
    step = environment->Act(*action->As<policy::Array>());
  } else if (const Value* reset = request.Find("reset")) {
    const Value* const seed = reset->Find("seed");
    const Value* const episode = reset->Find("episode");
    if (!seed || !seed->As<int64_t>() || !episode || !episode->As<int64_t>())
      throw InputError("reset: expected the integers 'seed' and 'episode'");
    if (*episode->As<int64_t>() < 0 || *episode->As<int64_t>() > kMaxEpisode) {
      throw InputError(
          fmt::format("reset: episode: expected 0 to {}, got {}", kMaxEpisode, *episode->As<int64_t>()));
    }
    step = environment->Reset(*seed->As<int64_t>(), static_cast<int>(*episode->As<int64_t>()));
  } else {
    throw InputError("expected a request with 'reset' or 'step', got " + Describe(request));
  }
  return Map{{"observation", std::move(step.observation)},
             {"scores", step.scores.dump()},
             {"episode", step.episode.is_null() ? Value() : Value(step.episode.dump())}};
}

int ServeEnvironment(EnvOptions options) {
  int end = 0;
  auto& form = options.environment.form;
  if (std::sscanf(options.image_size.c_str(), "%9dx%9d%n", &form.width_px, &form.height_px, &end) != 2 ||
      end != static_cast<int>(options.image_size.size())) {
    throw InputError("--image-size " + options.image_size + ": expected WIDTHxHEIGHT");
  }
  viz::CheckGl(options.environment.gl);
  ReservedStdout output;
  runner::Environment environment(options.environment);
  SendFrame(Description(environment, options.environment.gl), &output);
  while (const auto request = ReadRequest()) SendFrame(Answer(&environment, *request), &output);
  return 0;
}

}  // namespace

Action AddEnv(CLI::App* app) {
  const auto options = std::make_shared<EnvOptions>();
  runner::EnvironmentOptions& environment = options->environment;
  sim::SimOptions& sim = environment.sim;
  sim.control_hz = 20;
  app->add_option("task", sim.task, "TASK[/VARIATION]")->required();
  CLI::Option* const contract = app->add_option(
      "--contract", environment.contract,
      "contract that describes observations and actions: a file, or one of 'evalbus policy list'");
  app->add_option("--control", environment.form.control,
                  "without --contract: meaning of an action: " + runner::ControlNames())
      ->capture_default_str();
  AddList(app, "--camera", &environment.form.cameras,
          "without --contract: cameras whose images are observed, separated by commas");
  app->add_option("--image-size", options->image_size, "without --contract: size of the images")
      ->type_name("WxH")
      ->capture_default_str();
  app->add_option("--control-hz", sim.control_hz, "without --contract: steps per simulated second")
      ->check(InRange(5.0, 500.0))
      ->capture_default_str();
  for (const char* const name : {"--control", "--camera", "--image-size", "--control-hz"})
    contract->excludes(app->get_option(name));
  app->add_option("--gl", environment.gl, viz::kGlHelp)->capture_default_str();
  app->add_option(
      "--robot", sim.robot,
      "robot that replaces the task's own: a name in models/robots, or a robot description (YAML)");
  app->add_option(
         "--seed-stream", sim.seed_stream,
         "scheme that derives the starts from the seed; roboeval/1: like RoboEval's env.reset(seed=...)")
      ->capture_default_str();
  AddModelSources(app, &sim.model_path, &sim.assets);
  return [options] { return ServeEnvironment(*options); };
}

}  // namespace evalbus::commands
