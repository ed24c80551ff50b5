#include "base/help.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <regex>
#include <sstream>

#include "base/suggestion.h"
#include "base/text.h"

namespace evalbus {
namespace {

constexpr size_t kColumn = 28;  // column at which descriptions begin
constexpr char kUngrouped[] = "Options";

// Returns the words of a string. The word "\n" stands for a line break that is kept.
std::vector<std::string> WordsAndBreaks(const std::string& text) {
  std::vector<std::string> words;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream in_line(line);
    bool is_first = true;
    for (std::string word; in_line >> word; is_first = false) {
      if (is_first && !words.empty() && word.find(':') != std::string::npos && word != "default:")
        words.push_back("\n");
      words.push_back(word);
    }
  }
  return words;
}

// Returns the options of a group that --help lists, without positional arguments.
std::vector<const CLI::Option*> Listed(const CLI::App& app, const std::string& group) {
  return app.get_options(
      [&](const CLI::Option* option) { return option->get_group() == group && option->nonpositional(); });
}

std::vector<std::string> OptionNames(const CLI::App& app) {
  std::vector<std::string> names;
  const auto add = [&](const CLI::App& part) {
    for (const CLI::Option* option : part.get_options()) {
      if (option->get_group().empty()) continue;
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
      for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    }
  };
  add(app);
  for (const CLI::App* part : app.get_subcommands({})) {
    if (part->get_name().empty()) add(*part);  // a group of options
  }
  return names;
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* part : app.get_subcommands({})) {
    if (!part->get_name().empty()) names.push_back(part->get_name());
  }
  return names;
}

}  // namespace

size_t TerminalWidth() {
  constexpr size_t kLeast = 60, kMax = 140, kDefault = 100;
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
    return std::clamp<size_t>(size.ws_col, kLeast, kMax);
  size_t columns = 0;
  if (const char* text = std::getenv("COLUMNS")) std::from_chars(text, text + std::strlen(text), columns);
  return columns > 0 ? std::clamp(columns, kLeast, kMax) : kDefault;
}

std::string Wrapped(const std::string& text, size_t indent, size_t width) {
  std::string wrapped;
  size_t at = indent;
  const auto begin_line = [&] {
    wrapped += "\n" + std::string(indent, ' ');
    at = indent;
  };
  for (const std::string& word : WordsAndBreaks(text)) {
    if (word == "\n") {
      begin_line();
      continue;
    }
    const auto length = static_cast<size_t>(Width(word));
    if (at > indent && at + 1 + length > width) begin_line();
    if (at > indent) {
      wrapped += ' ';
      ++at;
    }
    wrapped += word;
    at += length;
  }
  return wrapped;
}

HelpFormatter::HelpFormatter() : width_(TerminalWidth()) {
  label("SUBCOMMAND", "COMMAND");
  label("Positionals", "Arguments");
}

std::string HelpFormatter::Row(const std::string& name, const std::string& description) const {
  std::string row = "  " + name;
  const auto length = static_cast<size_t>(Width(row));
  if (description.empty()) return row + "\n";
  row += length < kColumn ? std::string(kColumn - length, ' ') : "\n" + std::string(kColumn, ' ');
  return row + Wrapped(description, kColumn, width_) + "\n";
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const {
  std::string help = make_description(app) + make_usage(app, std::move(name)) + make_positionals(app);
  std::vector<std::string> groups = app->get_groups();
  std::stable_partition(groups.begin(), groups.end(),
                        [](const std::string& group) { return group != kUngrouped; });
  std::string options;
  for (const std::string& group : groups) {
    const auto listed = Listed(*app, group);
    if (group.empty() || listed.empty()) continue;
    const bool is_rest = group == kUngrouped && !options.empty();
    options += make_group(is_rest ? "Other options" : group, false, listed);
  }
  // Commands come first, because users run `evalbus --help` to find a command.
  const bool commands_first = !CommandNames(*app).empty();
  const std::string commands = make_subcommands(app, mode);
  help += commands_first ? commands + options : options + commands;
  const std::string footer = make_footer(app);
  return footer.empty() ? help : help + "\n" + footer;
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  std::string name = make_option_name(option, is_positional) + make_option_opts(option);
  // CLI11 repeats the type in front of a range: "INT:INT in [1 - 9]".
  for (const std::string type : {"INT", "UINT", "FLOAT"}) {
    const std::string twice = " " + type + ":" + type + " in ";
    if (const size_t found = name.find(twice); found != std::string::npos)
      name.replace(found, twice.size(), " " + type + " in ");
  }
  return Row(name, make_option_desc(option));
}

std::string HelpFormatter::make_subcommand(const CLI::App* app) const {
  return Row(app->get_name(), app->get_description());
}

std::string HelpFormatter::make_expanded(const CLI::App* app) const {
  if (!app->get_name().empty()) return CLI::Formatter::make_expanded(app);
  const bool is_choice = app->get_require_option_min() == 1 && app->get_require_option_max() == 1;
  std::string rows;
  for (const CLI::Option* option : app->get_options()) {
    if (option != app->get_help_ptr()) rows += make_option(option, false);
  }
  return "\n" + app->get_group() + (is_choice ? " (exactly one of these)" : "") + ":\n" + rows;
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  return Wrapped(app->get_description(), 0, width_) + "\n";
}

void UseHelpFormatter(CLI::App* app) {
  app->formatter(std::make_shared<HelpFormatter>());
  app->set_help_flag("-h,--help", "print this help and exit");
}

void GroupOptions(CLI::App* app,
                  const std::vector<std::pair<std::string, std::vector<std::string>>>& groups) {
  for (const auto& [group, names] : groups) {
    for (const std::string& name : names) {
      CLI::Option* const option = app->get_option(name);
      if (!option->get_group().empty()) option->group(group);
    }
  }
}

std::string ParseErrorText(const CLI::App& app, const CLI::ParseError& error) {
  const auto is_option = [](const std::string& word) { return word.size() > 1 && word[0] == '-'; };
  const std::vector<std::string> unknown = app.remaining();
  const auto option = std::ranges::find_if(unknown, is_option);
  const std::vector<std::string> commands = CommandNames(app);
  if (unknown.empty() && !commands.empty()) return "expected a command: " + ListOf(commands);
  // If an unknown word is in the place of a command, CLI11 only reports that a command is missing.
  if (!unknown.empty() && !is_option(unknown[0]) && !commands.empty()) {
    return "there is no command '" + unknown[0] + "'" + Suggestion(unknown[0], commands, "");
  }
  if (option != unknown.end()) {
    const std::string name = option->substr(0, option->find('='));
    return "there is no option '" + name + "'" + Suggestion(name, OptionNames(app), "");
  }
  static const std::regex conversion(R"(Could not convert: (\S+) = (.*))");
  static const std::regex count(R"((\S+): At Most (\d+) required but received (\d+))");
  static const std::regex excludes(R"((\S+) excludes (\S+))");
  std::string text = std::regex_replace(error.what(), conversion, "$1: expected a number, not '$2'");
  text = std::regex_replace(text, count, "$1: expected at most $2, got $3");
  return std::regex_replace(text, excludes, "$1 cannot be combined with $2");
}

}  // namespace evalbus
