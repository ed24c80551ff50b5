#include "base/arguments.h"

#include <iostream>
#include <utility>

namespace evalbus {

std::optional<int> ParseArguments(CLI::App* app, int argc, char** argv) {
  try {
    app->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::CallForHelp& help) {
    return app->exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: " << error.what() << " (--help lists the options)\n";
    return 1;
  } catch (const std::exception& error) {
    // A file that an option names.
    return ReportError(error);
  }
}

void AddOptionsFile(CLI::App* app, const std::function<void(const std::string&)>& read) {
  app->add_option_function<std::string>("--options", read)->group("");
}

}  // namespace evalbus
