// Main function of the program `evalbus`, which runs all commands.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/exit_guard.h"
#include "base/file_errors.h"
#include "base/help.h"
#include "base/plugins.h"
#include "cli/commands/commands.h"
#include "runner/version.h"

namespace {

using namespace evalbus::commands;

constexpr struct {
  const char* group;
  const char* name;
  const char* description;
  const char* examples;
  AddCommand* add;
} kCommands[] = {
#define EVALBUS_ROW(function, group, name, description, examples) \
  {group, name, description, examples, function},
    EVALBUS_COMMANDS(EVALBUS_ROW)
#undef EVALBUS_ROW
};

// Throws EnvironmentError if output was lost, for example if the disk is full during `evalbus compare a b >
// FILE`.
void FlushStandardOutput() {
  errno = 0;
  const bool is_flushed = std::fflush(stdout) == 0;
  if (is_flushed && std::ferror(stdout) == 0) return;
  throw evalbus::EnvironmentError("cannot write standard output" +
                                  (errno == 0 ? "" : std::string(": ") + std::strerror(errno)));
}

}  // namespace

int main(int argc, char** argv) {
  const evalbus::ExitGuard exit_guard;
  evalbus::IgnoreFileSizeSignal();
  for (const char* variable : {evalbus::kPredicatePlugins, evalbus::kPolicyPlugins}) {
    if (const auto code = evalbus::LoadPlugins(variable)) return *code;
  }
  CLI::App app{
      "evalbus evaluates robot-manipulation policies on a message bus and scores them while they run.",
      "evalbus"};
  evalbus::UseHelpFormatter(&app);
  app.set_version_flag("--version", std::string("evalbus ") + evalbus::kVersion + " " + evalbus::kGitCommit,
                       "print version and commit, and exit");
  app.require_subcommand(0, 1);
  std::vector<std::pair<CLI::App*, Action>> actions;
  for (const auto& command : kCommands) {
    CLI::App* const part = app.add_subcommand(command.name, command.description);
    actions.emplace_back(part, command.add(part));
    // The group is set last, because subcommands that are added later inherit it.
    part->group(command.group);
    part->footer(std::string("Examples:\n") + command.examples);
  }
  app.footer("'evalbus COMMAND --help' lists the options of a command and shows examples.");
  try {
    app.parse(argc, argv);
    for (const auto& [part, action] : actions) {
      if (!part->parsed()) continue;
      const int code = evalbus::WithClearFileErrors(action);
      FlushStandardOutput();
      return code;
    }
    std::cout << app.help();
    FlushStandardOutput();
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help, --version
      try {
        const int code = app.exit(error);
        FlushStandardOutput();
        return code;
      } catch (const evalbus::EnvironmentError& lost) {
        return evalbus::ReportError(lost);
      }
    }
    std::string typed = "evalbus";
    const CLI::App* part = &app;
    while (!part->get_subcommands().empty()) {
      part = part->get_subcommands()[0];
      typed += " " + part->get_name();
    }
    std::cerr << "error: " << evalbus::ParseErrorText(*part, error) << " (see '" << typed << " --help')\n";
    return 1;
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  } catch (...) {
    return evalbus::ReportError(evalbus::EnvironmentError(evalbus::kNotAnException));
  }
}
