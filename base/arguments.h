// Command lines.
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

// A file beyond `ulimit -f` is then an error of who writes it, and not a death without a word.
void IgnoreFileSizeSignal();

// Parses the arguments of a program. Returns its exit code where it ends with that: 0 after --help or
// --version, 1 after one line on stderr about what is wrong.
std::optional<int> ParseArguments(CLI::App* app, int argc, char** argv);

// Of a whole number: the library makes 0 of nothing, and the largest there is of a larger one.
CLI::Validator FitsInt64();

// --options FILE, for programs that a run consists of.
void AddOptionsFile(CLI::App* app, const std::function<void(const std::string& file)>& read);

// Adds the options of a table, and --options FILE, which takes all of them from a JSON file, a run's
// run.json, and `out`, where there is one, from the folder it is in; what the command line names besides goes
// before. Without help an option is hidden. Lists are separated by commas, but for paths.
template <class Options>
void AddOptions(CLI::App* app, Options* options) {
  // Added first, so it is taken first.
  AddOptionsFile(app, [options](const std::string& file) {
    ReadOptions(ReadJsonFile(file), file, options);
    if constexpr (requires { options->out = file; }) options->out = std::filesystem::path(file).parent_path();
  });
  ForEachOption(*options, [&](const auto& row, auto& value) {
    using Value = std::decay_t<decltype(value)>;
    CLI::Option* option = nullptr;
    if constexpr (std::is_same_v<Value, bool>) {
      option = app->add_flag(OptionName(row.key), value, row.help);
    } else {
      option = app->add_option(OptionName(row.key), value, row.help);
      if constexpr (std::is_same_v<Value, std::vector<std::filesystem::path>>) {
        option->allow_extra_args(false);  // a path may have a comma in it: the option is repeated
      } else if constexpr (requires { value.emplace_back(); }) {
        option->delimiter(',')->allow_extra_args(false);
      } else {
        option->capture_default_str();
      }
    }
    if constexpr (std::is_same_v<Value, std::vector<int>> ||
                  (std::is_integral_v<Value> && !std::is_same_v<Value, bool>)) {
      option->check(FitsInt64());
    }
    if (row.help.empty()) option->group("");
  });
}

}  // namespace evalbus
