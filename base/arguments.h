// Command-line parsing.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "base/json_file.h"
#include "base/options_json.h"

namespace evalbus {

// Ignores SIGXFSZ, so that exceeding `ulimit -f` is reported as a write error instead of killing the process.
void IgnoreFileSizeSignal();

// Parses the arguments of a program. Returns the exit code if the program has to exit: 0 after --help or
// --version, 1 after a wrong command line, 1 or 2 (base/errors.h) if a file that an option names cannot be
// read. Errors are reported in one line on stderr.
std::optional<int> ParseArguments(CLI::App* app, int argc, char** argv);

// Checks that a string is an integer of 64 bits. CLI11 itself reads an empty string as 0 and clamps a number
// that is too large. is_list: whether the error states that a list is expected.
CLI::Validator FitsInt64(bool is_list = false);

// Checks that a string is not empty.
CLI::Validator NotEmpty();

// Checks that a number is in a range, both ends included. Unlike CLI::Range, it refuses NaN.
CLI::Validator InRange(double least, double most);

// Adds an option whose values are separated by commas. The option takes only one argument, so that positional
// arguments may follow it.
template <class Value>
CLI::Option* AddList(CLI::App* app, const std::string& name, std::vector<Value>* values,
                     const std::string& help) {
  CLI::Option* const option = app->add_option(name, *values, help)->delimiter(',')->allow_extra_args(false);
  if constexpr (std::is_integral_v<Value>) option->check(FitsInt64(true));
  if constexpr (std::is_same_v<Value, std::string>) option->check(NotEmpty());
  return option;
}

// Adds the option --options FILE. When it is parsed, `read` is called with the name of the file. `evalbus
// run` uses the option to pass run.json to the processes of a run.
void AddOptionsFile(CLI::App* app, const std::function<void(const std::string& file)>& read);

// Adds the options of a table, and --options FILE, which reads these options from a JSON file (run.json of a
// run) and sets `out`, if `options` has this member, to the file's folder. Other options on the command line
// take precedence. An option without help is hidden. Elements of lists are separated by commas, except for
// paths.
template <class Options>
void AddOptions(CLI::App* app, Options* options) {
  // The file comes first, because CLI11 applies options in the order in which they were added.
  AddOptionsFile(app, [options](const std::string& file) {
    ReadOptions(ReadJsonFile(file), file, options);
    if constexpr (requires { options->out = file; }) options->out = std::filesystem::path(file).parent_path();
  });
  ForEachOption(*options, [&](const auto& row, auto& value) {
    using Value = std::decay_t<decltype(value)>;
    CLI::Option* option = nullptr;
    if constexpr (std::is_same_v<Value, bool>) {
      option = app->add_flag(OptionName(row.key), value, row.help);
    } else if constexpr (std::is_same_v<Value, std::vector<std::filesystem::path>>) {
      // A path may contain a comma, so the option is repeated for several paths.
      option = app->add_option(OptionName(row.key), value, row.help)->allow_extra_args(false);
    } else if constexpr (requires { value.emplace_back(); }) {
      option = AddList(app, OptionName(row.key), &value, row.help);
    } else {
      option = app->add_option(OptionName(row.key), value, row.help)->capture_default_str();
    }
    if constexpr (std::is_integral_v<Value> && !std::is_same_v<Value, bool>) option->check(FitsInt64());
    if (row.help.empty()) option->group("");
  });
}

}  // namespace evalbus
