#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "cli/commands.hpp"
#include "cli/view_command.hpp"

namespace {

/// "no command 'simulat'; did you mean 'simulate'?" for the first word that stands where a command is needed
/// and is none, and likewise for options. Empty where every word is known.
std::string unknown_word(const CLI::App& program, int argc, char** argv) {
  const CLI::App* app = &program;
  std::string path = program.get_name();
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    std::vector<std::string> known;
    const bool option = word.substr(0, 2) == "--";
    if (option) {
      const std::string name = word.substr(0, word.find('='));
      if (name == "--" || app->get_option_no_throw(name) != nullptr) continue;
      for (const CLI::Option* each : app->get_options()) {
        for (const std::string& long_name : each->get_lnames()) known.push_back("--" + long_name);
      }
    } else if (word.empty() || word.front() == '-') {
      continue;
    } else {
      for (const CLI::App* each : app->get_subcommands({})) {
        known.push_back(each->get_name());
        if (each->get_name() != word) continue;
        app = each;
        path += " " + word;
        known.clear();
        break;
      }
      if (known.empty() || app->get_require_subcommand_min() == 0) continue;
    }
    const std::string what = fmt::format("no {} '{}'", option ? "option" : "command", word);
    const auto meant = canyon::closest(word, known);
    if (meant) return fmt::format("{}; did you mean '{}'?", what, *meant);
    if (!option) return fmt::format("{}; it is one of {}", what, fmt::join(known, ", "));
    return fmt::format("{}; see {} --help", what, path);
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  using namespace canyon::cli;
  CLI::App app("Canyon: what a GNSS receiver sees in a city", "canyon");
  app.set_version_flag("--version", "canyon " CANYON_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Each command has its own --help. Exit status: 0 done, 2 bad input, 130 interrupted, 1 anything else.");
  Action action;
  add_simulate(app, action);
  add_live(app, action);
  add_sky(app, action);
  add_trace(app, action);
  add_skyplot(app, action);
  add_city(app, action);
  add_scenario(app, action);
  add_faults(app, action);
  add_profiles(app, action);
  add_validate(app, action);
  add_calibrate(app, action);
  add_heatmap(app, action);
  add_study(app, action);
  add_view(app, action);
  if (argc < 2) {
    fmt::print(stderr, "{}", app.help());
    return kBadInput;
  }
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::ParseError& error) {
    const std::string unknown = unknown_word(app, argc, argv);
    if (error.get_exit_code() != 0 && !unknown.empty()) {
      fmt::print(stderr, "canyon: {}\n", unknown);
      return kBadInput;
    }
    // CLI11's own codes tell apart what no caller needs apart: help is 0, any other is bad input.
    return app.exit(error) == 0 ? kOk : kBadInput;
  } catch (const canyon::InputError& error) {
    fmt::print(stderr, "canyon: {}\n", error.what());
    return exit_code(error);
  } catch (const std::exception& error) {
    fmt::print(stderr, "canyon: internal error: {}\n", error.what());
    return kFailure;
  }
}
