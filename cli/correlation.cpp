#include <fmt/format.h>

#include <filesystem>

#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/drawing/views/pictures.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/simulation/samples/correlation_record.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

struct CorrelationArguments : RunArguments {
  std::string out, satellite, signal, receiver;
  std::optional<double> bandwidth_hz;
};

/// A line for each instant and delay.
std::string csv_of(const samples::CorrelationSeries& series) {
  std::string text = "time_s,delay_m,in_phase,quadrature,measured_m\n";
  for (const auto& instant : series.instants) {
    const std::string measured =
        std::isnan(instant.measured_m) ? std::string() : encoding::fixed(instant.measured_m, 3);
    for (std::size_t k = 0; k < instant.values.size(); ++k) {
      text +=
          fmt::format("{},{},{},{},{}\n", encoding::fixed(instant.time_s, 3),
                      encoding::fixed(series.delays_m[k], 3), encoding::fixed(instant.values[k].real(), 6),
                      encoding::fixed(instant.values[k].imag(), 6), measured);
    }
  }
  return text;
}

int run_correlation(const CorrelationArguments& arguments) {
  const std::string ending = lower_case(std::filesystem::path(arguments.out).extension().string());
  if (ending != ".png" && ending != ".svg" && ending != ".csv") {
    throw InputError(fmt::format("--out '{}' does not end in .png, .svg or .csv", arguments.out),
                     "give the file one of these endings");
  }
  const auto satellite = gnss::parse_satellite(arguments.satellite);
  if (!satellite) {
    throw InputError(fmt::format("'{}' is not a satellite", arguments.satellite),
                     "give a name such as G05, E11 or C23");
  }
  const simulation::Scenario scenario = read_scenario(arguments);
  samples::CorrelationRecord::Options options;
  options.receiver = simulation::find_receiver(scenario, arguments.receiver);
  options.satellite = *satellite;
  options.signal = arguments.signal;
  if (arguments.bandwidth_hz) options.bandwidth_hz = *arguments.bandwidth_hz;

  const auto simulation = make_ready(scenario, arguments.scenario).simulation;
  samples::CorrelationRecord record(*simulation, options);
  const simulation::RunResult result = run(*simulation, {&record}, arguments, "epochs");
  if (ending == ".csv") {
    write_file(arguments.out, csv_of(record.series()));
  } else {
    const drawing::Picture picture = drawing::draw_correlation(record.series(), record.correlation());
    write_file(arguments.out, ending == ".png" ? picture.png : picture.svg);
  }
  std::size_t received = 0, maximum = 0;
  for (const auto& instant : record.series().instants) {
    received += instant.paths.empty() ? 0 : 1;
    maximum = std::max(maximum, instant.paths.size());
  }
  note(arguments.quiet,
       fmt::format("{}: {} {} of {}, {} epochs, received in {}, up to {} paths", arguments.out,
                   arguments.satellite, record.series().signal, record.series().receiver,
                   record.series().instants.size(), received, maximum));
  return result.interrupted ? kInterrupted : kOk;
}

}  // namespace

void add_correlation(Command& app) {
  Command& command = app.add_command(
      "correlation", "draw a satellite's correlation function with its reflections over time");
  command.footer =
      "canyon correlation drive.yaml --satellite G05 --out correlation.png\n"
      "FILE.csv has the complex values. docs/iq.md explains the picture.";
  CorrelationArguments& arguments = command.run_with(run_correlation);
  add_scenario_file(command, arguments.scenario);
  command.add_option("--satellite", arguments.satellite, "NAME", "G05, E11, C23").required();
  command.add_option("-o,--out", arguments.out, "FILE", "picture (.png, .svg) or values (.csv)")
      .required()
      .writes();
  command.add_option("--signal", arguments.signal, "NAME", "L1CA, E5a, B1I ... (the one near L1)");
  command.add_option("--receiver", arguments.receiver, "NAME", "one of the scenario's receivers (the first)");
  command.add_option("--bandwidth", arguments.bandwidth_hz, "HZ",
                     "two-sided bandwidth of the front end (no limit)");
  add_run_field(command, "--rate", arguments, "rate_hz");
  add_run_options(command, arguments);
}

}  // namespace canyon::cli
