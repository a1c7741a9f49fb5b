// No header declares it: the program begins here.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "cli/commands.hpp"

int main(int argc, char** argv) {
  using namespace canyon::cli;
  Command program{"canyon", "Canyon: what a GNSS receiver sees in a city"};
  program.footer =
      "Each command has its own --help. Exit status: 0 done, 2 bad input, 130 interrupted, 1 anything else.";
  add_demo(program);
  add_simulate(program);
  add_live(program);
  add_sky(program);
  add_trace(program);
  add_skyplot(program);
  add_city(program);
  add_check(program);
  add_scenario(program);
  add_faults(program);
  add_profiles(program);
  add_validate(program);
  add_calibrate(program);
  add_heatmap(program);
  add_iq(program);
  add_correlation(program);
  add_rtk(program);
  add_study(program);
  add_view(program);
  add_completion(program);
  add_manual(program, "canyon " CANYON_VERSION);
  try {
    return run(program, "canyon " CANYON_VERSION, argc, argv);
  } catch (const canyon::InputError& error) {
    fmt::print(stderr, "canyon: {}\n", error.what());
    return exit_code(error);
  } catch (const std::exception& error) {
    fmt::print(stderr, "canyon: internal error: {}\n", error.what());
    return kFailure;
  }
}
