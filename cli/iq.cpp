#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "canyon/samples/sample_file.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/transport/byte_sink.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

struct IqArguments {
  std::string scenario, out;
  std::vector<std::string> receivers;
  std::optional<double> duration_s, epoch_rate_hz;
  std::optional<std::size_t> seed;
  Changes<simulation::SampleOptions> changes;
  int threads = 0;
  bool real = false, no_noise = false, quiet = false;
};

/// The receivers that are asked for, by their names; without any the only one.
std::vector<std::size_t> chosen_receivers(const IqArguments& arguments,
                                          const simulation::Scenario& scenario) {
  std::vector<std::string> names;
  for (const simulation::ReceiverConfig& receiver : scenario.receivers)
    names.push_back(receiver.options.name);
  std::vector<std::size_t> chosen;
  for (const std::string& name : arguments.receivers) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      throw InputError(fmt::format("--receiver '{}' is not in the scenario", name),
                       fmt::format("give {}", fmt::join(names, ", ")));
    }
    chosen.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  if (!chosen.empty()) return chosen;
  if (names.size() > 1) {
    throw InputError(
        fmt::format("the scenario has {} receivers", names.size()),
        fmt::format("choose by --receiver, which may be given again: {}", fmt::join(names, ", ")));
  }
  return {0};
}

/// "drive.iq" of a receiver where there are several: "drive.car.iq".
std::filesystem::path path_of(const IqArguments& arguments, const std::string& receiver) {
  std::filesystem::path out = arguments.out;
  if (arguments.receivers.size() <= 1) return out;
  if (out == "-" || transport::is_byte_sink(arguments.out)) {
    throw InputError(fmt::format("--out {} takes one receiver", arguments.out),
                     "give a file, or one --receiver");
  }
  return out.parent_path() / (out.stem().string() + "." + receiver + out.extension().string());
}

simulation::Scenario read_iq_scenario(const IqArguments& arguments) {
  simulation::Scenario scenario = simulation::read_scenario(arguments.scenario);
  if (arguments.seed) scenario.seed = *arguments.seed;
  if (arguments.duration_s) scenario.duration_s = arguments.duration_s;
  if (arguments.epoch_rate_hz) scenario.rate_hz = arguments.epoch_rate_hz;
  for (const auto& change : arguments.changes) change(scenario.samples);
  if (arguments.real) scenario.samples.real = true;
  if (arguments.no_noise) scenario.samples.noise = false;
  scenario.samples.validate();
  return scenario;
}

int run_iq(const IqArguments& arguments) {
  const simulation::Scenario scenario = read_iq_scenario(arguments);
  const std::vector<std::size_t> receivers = chosen_receivers(arguments, scenario);
  std::vector<std::string> warnings;
  city::City city = simulation::load_city(scenario, warnings);
  const simulation::Simulation simulation(scenario, std::move(city));
  if (!arguments.quiet) {
    print_warnings(warnings);
    print_warnings(simulation.warnings());
  }
  std::shared_ptr<transport::ByteSink> to;
  if (transport::is_byte_sink(arguments.out)) to = transport::open_byte_sink(arguments.out);
  std::vector<std::unique_ptr<samples::SampleFile>> files;
  std::vector<simulation::EpochSink*> sinks;
  for (const std::size_t receiver : receivers) {
    const auto path = path_of(arguments, scenario.receivers[receiver].options.name);
    for (auto& file : samples::make_sample_files(simulation, receiver, path, arguments.threads, to)) {
      note(arguments.quiet, file->about());
      sinks.push_back(file.get());
      files.push_back(std::move(file));
    }
  }

  if (to) {
    note(arguments.quiet, fmt::format("waiting for a reader of {}", arguments.out));
    to->wait_for_reader();
  }
  const std::atomic<bool>& stop_requested = catch_interrupts();
  simulation::RunResult result;
  {
    Progress progress("samples", arguments.quiet);
    simulation::RunOptions options;
    options.threads = arguments.threads;
    options.stop = &stop_requested;
    options.progress = progress.callback();
    result = simulation.run(sinks, options);
  }
  if (!arguments.quiet) print_warnings(result.warnings);
  for (const auto& file : files) {
    const samples::Generator::Contents contents = file->contents();
    std::vector<std::string> counts;
    for (const auto& [name, count] : contents.satellites) counts.push_back(fmt::format("{} {}", count, name));
    note(arguments.quiet,
         fmt::format("{} samples: {}; up to {} paths", file->samples(),
                     counts.empty() ? "no signal" : fmt::format("{}", fmt::join(counts, ", ")),
                     contents.most_paths));
  }
  if (result.interrupted) {
    fmt::print(stderr, "canyon: interrupted: {} of {} epochs finished and written\n", result.epochs,
               result.planned);
    return kInterrupted;
  }
  note(arguments.quiet, fmt::format("{:.1f} s in {:.1f} s, {:.2f} times real time", result.simulated_s,
                                    result.wall_s, result.simulated_s / std::max(result.wall_s, 1e-9)));
  return kOk;
}

}  // namespace

void add_iq(Command& app) {
  Command& command =
      app.add_command("iq", "write the signal at the antenna as samples, for software receivers");
  command.footer =
      "canyon iq drive.yaml --out drive.iq --band L1 --rate 4e6 --format int8\n"
      "The scenario's samples: has the defaults of the options below.\n"
      "docs/iq.md plays the file to GNSS-SDR. Do not transmit a file of samples.";
  IqArguments& arguments = command.run_with(run_iq);
  command.add_option("scenario", arguments.scenario, "SCENARIO", "scenario file (YAML)").required();
  command
      .add_option(
          "-o,--out", arguments.out, "FILE",
          "file for the samples (real and imaginary parts alternate) and FILE.sigmf-meta; - or a FIFO: a "
          "pipe; tcp://127.0.0.1:PORT waits for a reader, tcp-connect://HOST:PORT connects to one; "
          "zmq://127.0.0.1:PORT publishes to a subscriber of ZeroMQ")
      .required();
  const auto add = [&](const char* flag, const char* name) -> Option& {
    return add_change(command, flag, arguments.changes, name);
  };
  add("--band", "bands");
  add("--centre-hz", "centre_hz").excludes("--band");
  add("--rate", "rate_hz");
  add("--if", "intermediate_hz");
  add("--bandwidth", "bandwidth_hz");
  command.add_flag("--real", arguments.real, "real samples, at an intermediate frequency (--if)");
  add("--format", "format");
  add("--noise-level", "noise_level");
  add("--agc", "agc_s");
  command.add_flag("--no-noise", arguments.no_noise, "no noise of the front end");
  command
      .add_option("--receiver", arguments.receivers, "NAME",
                  "one of the scenario's receivers; may be repeated")
      .repeated();
  command.add_option("--seed", arguments.seed, "N", "instead of the scenario's seed");
  command.add_option("--duration", arguments.duration_s, "S", "instead of the scenario's duration_s");
  command.add_option("--epoch-rate", arguments.epoch_rate_hz, "HZ",
                     "rate at which paths are traced, instead of the scenario's rate_hz");
  add_threads(command, arguments.threads);
  command.add_flag("--quiet", arguments.quiet, "print errors only");
}

}  // namespace canyon::cli
