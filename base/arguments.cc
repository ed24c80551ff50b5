#include "base/arguments.h"

#include <cmath>
#include <csignal>
#include <iostream>

#include "base/help.h"
#include "base/number_from.h"

namespace evalbus {

void IgnoreFileSizeSignal() { std::signal(SIGXFSZ, SIG_IGN); }

std::optional<int> ParseArguments(CLI::App* app, int argc, char** argv) {
  IgnoreFileSizeSignal();
  UseHelpFormatter(app);
  app->set_version_flag("--version",
                        std::filesystem::path(argv[0]).filename().string() + " " EVALBUS_VERSION);
  try {
    app->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::Success& asked) {
    return app->exit(asked);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: " << ParseErrorText(*app, error) << " (see --help)\n";
    return 1;
  } catch (const std::exception& error) {
    // The error means that a file that an option names could not be read.
    return ReportError(error);
  }
}

CLI::Validator FitsInt64(bool is_list) {
  return CLI::Validator(
      [is_list](const std::string& text) {
        // CLI11 would read a number with a leading zero as octal.
        const size_t digit = text.starts_with('-') ? 1 : 0;
        const bool is_decimal = text.size() == digit + 1 || text.substr(digit, 1) != "0";
        if (is_decimal && NumberFrom<int64_t>(text)) return std::string();
        return (is_list ? "expected whole numbers of at most 64 bits, separated by commas, not '"
                        : "expected a whole number of at most 64 bits, not '") +
               text + "'";
      },
      "");
}

CLI::Validator NotEmpty() {
  return CLI::Validator(
      [](const std::string& text) { return std::string(text.empty() ? "expected a value" : ""); }, "");
}

CLI::Validator InRange(double least, double most) {
  const CLI::Range range(least, most);
  return CLI::Validator(
      [range](std::string& text) {
        double number = 0;
        const bool is_nan = CLI::detail::lexical_cast(text, number) && std::isnan(number);
        return is_nan ? "Value " + text + " is not a number" : range(text);
      },
      range.get_description());
}

void AddOptionsFile(CLI::App* app, const std::function<void(const std::string&)>& read) {
  app->add_option_function<std::string>(
      "--options", read,
      "run.json of a run to take the options from; options on the command line take precedence");
}

}  // namespace evalbus
