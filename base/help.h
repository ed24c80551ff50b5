// Layout of --help.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace evalbus {

// Returns the width of the terminal on standard output. If standard output is not a terminal, returns COLUMNS
// from the environment or, if that is not a positive number, 100. The terminal's width and COLUMNS are
// limited to 60 to 140.
size_t TerminalWidth();

// Wraps lines at `width` and indents all but the first, which begins at column `indent`. A line break in the
// text is kept if the word after it contains a colon ("replay:RUN: ...", an entry of a list) and is not
// "default:"; other line breaks become blanks.
std::string Wrapped(const std::string& text, size_t indent, size_t width);

// Wraps descriptions at the width of the terminal. Prints groups of options in their order, and ungrouped
// options last. Subcommands inherit the formatter.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* app) const override;
  std::string make_expanded(const CLI::App* app) const override;
  std::string make_description(const CLI::App* app) const override;

 private:
  std::string Row(const std::string& name, const std::string& description) const;

  size_t width_;
};

// Sets the formatter and the texts of CLI11. Must be called before subcommands are added.
void UseHelpFormatter(CLI::App* app);

// Distributes options over groups: {group, {"--option", ...}}. Options that --help does not list stay hidden.
void GroupOptions(CLI::App* app, const std::vector<std::pair<std::string, std::vector<std::string>>>& groups);

// Returns one line about a wrong command line. If a command or option is unknown, the line names it and the
// most similar known one, if any is similar.
std::string ParseErrorText(const CLI::App& app, const CLI::ParseError& error);

}  // namespace evalbus
