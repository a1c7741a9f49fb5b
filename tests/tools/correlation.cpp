// Correlation functions of a satellite over a run, as CSV: a line for each instant and delay.
//
// usage: correlation_csv SCENARIO --satellite NAME [--signal NAME] [--duration SECONDS]
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/samples/correlation_record.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon {
namespace {

void print_correlation(const std::vector<std::string>& arguments) {
  if (arguments.size() % 2 != 1) throw InputError("the arguments are not SCENARIO and pairs --NAME VALUE");
  simulation::Scenario scenario = simulation::read_scenario(arguments[0]);
  samples::CorrelationRecord::Options options;
  for (std::size_t i = 1; i < arguments.size(); i += 2) {
    const std::string &name = arguments[i], &value = arguments[i + 1];
    if (name == "--satellite") {
      const auto satellite = gnss::parse_satellite(value);
      if (!satellite) throw InputError(fmt::format("'{}' is not a satellite", value));
      options.satellite = *satellite;
    } else if (name == "--signal") {
      options.signal = value;
    } else if (name == "--duration") {
      scenario.duration_s = parse_double(value);
    } else {
      throw InputError(fmt::format("'{}' is not an option", name));
    }
  }
  city::City city = simulation::load_city(scenario);
  const simulation::Simulation simulation(std::move(scenario), std::move(city));
  samples::CorrelationRecord record(simulation, options);
  simulation.run({&record});

  const samples::CorrelationSeries& series = record.series();
  fmt::print("time_s,delay_m,in_phase,quadrature,measured_m\n");
  for (const auto& instant : series.instants) {
    const std::string measured =
        std::isnan(instant.measured_m) ? std::string() : encoding::fixed(instant.measured_m, 3);
    for (std::size_t k = 0; k < instant.values.size(); ++k) {
      fmt::print("{},{},{},{},{}\n", encoding::fixed(instant.time_s, 3),
                 encoding::fixed(series.delays_m[k], 3), encoding::fixed(instant.values[k].real(), 6),
                 encoding::fixed(instant.values[k].imag(), 6), measured);
    }
  }
}

}  // namespace
}  // namespace canyon

int main(int argc, char** argv) {
  try {
    canyon::print_correlation({argv + 1, argv + argc});
    return 0;
  } catch (const canyon::InputError& error) {
    fmt::print(stderr, "correlation_csv: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "correlation_csv: {}\n", error.what());
    return 1;
  }
}
