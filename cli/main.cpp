#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "canyon/base/input_error.hpp"
#include "cli/commands.hpp"

int main(int argc, char** argv) {
  using namespace canyon::cli;
  CLI::App app("Canyon: what a GNSS receiver sees in a city", "canyon");
  app.set_version_flag("--version", "canyon " CANYON_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Each command has its own --help. Exit status: 0 done, 2 bad input, 130 interrupted, 1 anything else.");
  Action action;
  add_simulate(app, action);
  add_sky(app, action);
  add_trace(app, action);
  add_skyplot(app, action);
  add_city(app, action);
  add_profiles(app, action);
  add_validate(app, action);
  add_heatmap(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // CLI11's own codes tell apart what no caller needs apart: help is 0, any other is bad input.
    return app.exit(error) == 0 ? kOk : kBadInput;
  }
  try {
    return action();
  } catch (const canyon::InputError& error) {
    fmt::print(stderr, "canyon: {}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "canyon: internal error: {}\n", error.what());
    return kFailure;
  }
}
